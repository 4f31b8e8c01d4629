"""Short tours that see enough of a floor: large neighbourhood search over the places to look from."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from experiments.oracle.floor import Floor
from experiments.oracle.ways import Ways

Stops = list[int]
"""Places in the order of a tour, which begins at the start and ends at the last of them."""

LARGEST_RUIN, LARGEST_SHARE = 12, 0.4
"""At most so many stops, and this share of them, are taken out of a tour at a time."""
HEAT = 0.01
"""At first a tour may become longer by about this share; nothing at the end."""


class TourSearch:
    """Improves tours that see at least `share` of the samples. What is seen on the way counts.

    Ruin and recreate (Schrimpf et al., Record breaking optimization results using the ruin and recreate
    principle, 2000): take some neighbouring stops out, put places in that see most of what is then missing
    for the least detour, order all stops by 2-opt and Or-opt, take out what has become needless.
    """

    def __init__(self, floor: Floor, ways: Ways, share: float, rng: np.random.Generator) -> None:
        from experiments.oracle import tour_kernels

        self.floor, self.ways = floor, ways
        self.needed = min(share * floor.weight.sum(), floor.weight[np.unique(floor.sees.columns)].sum())
        self._kernels = tour_kernels
        self._rng = rng

    def length_m(self, stops: Stops) -> float:
        """Of the ways between stops, pulled tight."""
        return sum(self.ways.leg(a, b).length_m for a, b in pairwise(stops))

    def improved(self, stops: Stops, rounds: int) -> Stops:
        """The shortest tour found in so many rounds; the one given if it is none shorter and sees enough."""
        now = best = self.completed(stops, greed=1.0)
        now_m = best_m = self.length_m(best)
        for k in range(rounds):
            other = self.completed(self._ruined(now), greed=self._rng.uniform(0.5, 2.0))
            other_m = self.length_m(other)
            heat_m = HEAT * best_m * (1.0 - k / rounds)
            if other_m < now_m + heat_m * self._rng.exponential(0.2):
                now, now_m = other, other_m
            if other_m < best_m - 1e-9:
                best, best_m = other, other_m
        return best

    def completed(self, stops: Stops, greed: float) -> Stops:
        """A tour made to see enough again, in a good order, without needless stops."""
        stops = self._pruned(self._recreated(stops, greed))
        ordered = self._ordered(stops)
        return stops if ordered == stops else self._pruned(self._recreated(ordered, greed))

    def _ruined(self, stops: Stops) -> Stops:
        """Without a random stop and its nearest ones; or without a run of the tour."""
        if len(stops) < 2:
            return stops
        most = max(1, min(LARGEST_RUIN, round(LARGEST_SHARE * len(stops))))
        number, middle = int(self._rng.integers(1, most + 1)), int(self._rng.integers(1, len(stops)))
        if self._rng.random() < 0.5:
            return stops[:middle] + stops[middle + number :]
        away = self.ways.distance_m(stops[middle])[stops[1:]]
        gone = set((np.argsort(away, kind="stable")[:number] + 1).tolist())
        return [stop for k, stop in enumerate(stops) if k not in gone]

    def _recreated(self, stops: Stops, greed: float) -> Stops:
        """With places added, one by one, until the tour sees enough."""
        stops, seen = list(stops), Seen(self.floor, self.ways, stops)
        while (missing := self.needed - seen.weight) > 0:
            gain = np.minimum(seen.gain(), missing)
            candidates = np.flatnonzero(gain)
            away = np.stack([self.ways.distance_m(stop) for stop in stops])
            legs_m = np.array([away[k, b] for k, b in enumerate(stops[1:])])
            detour_m, after = self._kernels.best_insertions(away, legs_m, candidates)
            best = int(np.argmax(gain[candidates] ** greed / (detour_m + 0.1)))
            place, at = int(candidates[best]), int(after[best]) + 1
            seen.replace(stops[at - 1 : at + 1], [stops[at - 1], place, *stops[at : at + 1]])
            stops.insert(at, place)
        return stops

    def _ordered(self, stops: Stops) -> Stops:
        away = np.stack([self.ways.distance_m(stop)[stops] for stop in stops]).astype(np.float64)
        order = self._kernels.shortened(away, np.arange(len(stops)))
        return [stops[k] for k in order]

    def _pruned(self, stops: Stops) -> Stops:
        """Without stops that are not needed, those first whose detour is longest."""
        stops, seen = list(stops), Seen(self.floor, self.ways, stops)
        for stop in self._by_detour(stops):
            at = stops.index(stop)
            around = stops[at - 1 : at + 2]
            seen.replace(around, [around[0], *around[2:]])
            if seen.weight >= self.needed:
                del stops[at]
            else:
                seen.replace([around[0], *around[2:]], around)
        return stops

    def _by_detour(self, stops: Stops) -> Stops:
        leg_m = [self.ways.distance_m(a)[b] for a, b in pairwise(stops)]
        past_m = [self.ways.distance_m(a)[b] for a, b in zip(stops, stops[2:], strict=False)]
        detour_m = np.add(leg_m, [*leg_m[1:], 0.0]) - [*past_m, 0.0] if leg_m else np.empty(0)
        return [stops[k + 1] for k in np.argsort(-detour_m, kind="stable")]


class Seen:
    """How often a tour sees each sample."""

    def __init__(self, floor: Floor, ways: Ways, stops: Stops) -> None:
        from experiments.oracle import tour_kernels

        self._floor, self._ways, self._kernels = floor, ways, tour_kernels
        self.counts: NDArray[np.int32] = np.zeros(len(floor.samples), np.int32)
        self.weight = 0
        """Of the samples that are seen at all."""
        self._gain: NDArray[np.int64] | None = None
        self._counts_then = self.counts
        self._count(np.array([floor.start_place], np.int32), 1)
        self.replace([], stops)

    def replace(self, old: Sequence[int], new: Sequence[int]) -> None:
        """Drive through other stops."""
        for stops, sign in ((new, 1), (old, -1)):
            for a, b in pairwise(stops):
                self._count(self._ways.leg(a, b).places, sign)

    def gain(self) -> NDArray[np.int64]:
        """(p,) weight of the samples that each place would add. Costs what changed since last asked for."""
        rows, weight, kernels = self._floor.seen_from, self._floor.weight, self._kernels
        gain = self._gain
        if gain is None:
            gain = kernels.gains(self.counts, weight, rows.starts, rows.columns, len(self._floor.places))
        else:
            kernels.update(gain, self._counts_then, self.counts, weight, rows.starts, rows.columns)
        self._gain, self._counts_then = gain, self.counts.copy()
        return gain

    def _count(self, places: NDArray[np.int32], sign: int) -> None:
        rows, weight = self._floor.sees, self._floor.weight
        self.weight += self._kernels.count(self.counts, weight, rows.starts, rows.columns, places, sign)
