/* The lesson's integrate_scan, as one would write it in C: what experiments/benchmarking/kernels.py measures against. */
#include <stdint.h>
#include <stdlib.h>

static float clamped(float value, float clamp) {
    return value < -clamp ? -clamp : value > clamp ? clamp : value;
}

/* cells: (1 + beams) pairs (ix, iy), the sensor's first; log_odds: rows of nx cells. */
void integrate(float *log_odds, int nx, const int32_t *cells, const uint8_t *is_hit, int beams,
               float hit, float miss, float clamp) {
    for (int k = 0; k < beams; k++) {
        int x = cells[0], y = cells[1];
        const int x1 = cells[2 * k + 2], y1 = cells[2 * k + 3];
        const int dx = abs(x1 - x), dy = abs(y1 - y);
        const int sx = x < x1 ? 1 : -1, sy = y < y1 ? 1 : -1;
        int err = dx - dy;
        while (x != x1 || y != y1) {
            float *cell = log_odds + (long)y * nx + x;
            *cell = clamped(*cell + miss, clamp);
            const int e2 = 2 * err;
            if (e2 > -dy) { err -= dy; x += sx; }
            if (e2 < dx) { err += dx; y += sy; }
        }
        float *cell = log_odds + (long)y * nx + x;
        *cell = clamped(*cell + (is_hit[k] ? hit : miss), clamp);
    }
}
