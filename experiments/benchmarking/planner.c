/* The search of occmap/planner_kernels.py once more, for a comparison with what a C compiler makes of it. */

#include <stdint.h>

enum { STRAIGHT = 1024, DIAGONAL = 1448, BINS_PER_M = 200, OPEN = 8 };
#define UNREACHED INT32_MAX

static inline int64_t over(int64_t low, int64_t at, int64_t high) {
    int64_t d = low > at ? low - at : at - high;
    return d > 0 ? d : 0;
}

static inline int64_t octile(int64_t ix, int64_t iy, const int64_t *box) {
    int64_t dx = over(box[0], ix, box[2]), dy = over(box[1], iy, box[3]);
    return dx > dy ? STRAIGHT * dx + (DIAGONAL - STRAIGHT) * dy : STRAIGHT * dy + (DIAGONAL - STRAIGHT) * dx;
}

/* Fills cost and link from start until target is settled (-1: until nothing is left); cells touched.
 * items has room for m entries of the queue; cost holds UNREACHED throughout. */
int64_t search(const uint8_t *state, const float *clearance_m, int64_t nx, int64_t ny, const int32_t *entry_cost,
               int64_t bins, int64_t start, int64_t target, const int64_t *box, int64_t shift, int32_t *cost,
               uint8_t *link, int32_t *touched, int32_t *heads, int64_t ring, int32_t (*items)[2], int64_t m) {
    static const int step_x[8] = {1, 0, -1, 0, 1, -1, -1, 1}, step_y[8] = {0, 1, 0, -1, 1, 1, -1, -1};
    int64_t mask = ring - 1, vacant = 1, waiting = 1, n_touched = 1, is_settled = 0;
    for (int64_t k = 0; k < ring; k++) heads[k] = -1;
    for (int64_t k = 0; k < m; k++) items[k][1] = (int32_t)(k + 1);
    touched[0] = (int32_t)start;
    cost[start] = 0;
    link[start] = OPEN;
    int64_t bucket = octile(start % nx, start / nx, box) >> shift;
    items[0][0] = (int32_t)start;
    items[0][1] = -1;
    heads[bucket & mask] = 0;
    while (waiting > 0) {
        int64_t item = heads[bucket & mask];
        if (item < 0) {
            if (is_settled) break;
            bucket++;
            continue;
        }
        int64_t cell = items[item][0];
        heads[bucket & mask] = items[item][1];
        items[item][1] = (int32_t)vacant;
        vacant = item;
        waiting--;
        if (!(link[cell] & OPEN)) continue;
        link[cell] &= ~OPEN;
        if (cell == target) is_settled = 1;
        int64_t so_far = cost[cell], iy = cell / nx, ix = cell - iy * nx;
        int passable[8];
        for (int k = 0; k < 8; k++) {
            int64_t jx = ix + step_x[k], jy = iy + step_y[k];
            passable[k] = 0;
            if (jx < 0 || jy < 0 || jx >= nx || jy >= ny) continue;
            if (k >= 4 && !(passable[k - 4] && passable[(k - 3) & 3])) continue;
            int64_t other = jy * nx + jx, known = cost[other];
            if (known <= so_far + STRAIGHT) {
                passable[k] = 1;
                continue;
            }
            int64_t column = (int64_t)(clearance_m[other] * BINS_PER_M + 0.02);
            int64_t step = entry_cost[state[other] * bins + (column < bins ? column : bins - 1)];
            if (step == 0) continue;
            passable[k] = 1;
            if (k >= 4) step = (step * DIAGONAL) >> 10;
            int64_t there = so_far + step;
            if (there >= known) continue;
            if (known == UNREACHED) touched[n_touched++] = (int32_t)other;
            cost[other] = (int32_t)there;
            link[other] = (uint8_t)(OPEN | k);
            if (vacant >= m) return -1;
            int64_t slot = ((there + octile(jx, jy, box)) >> shift) & mask, following = items[vacant][1];
            items[vacant][0] = (int32_t)other;
            items[vacant][1] = heads[slot];
            heads[slot] = (int32_t)vacant;
            vacant = following;
            waiting++;
        }
    }
    return n_touched;
}
