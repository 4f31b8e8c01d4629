"""What a lidar gets wrong, one source at a time, each with its own chance."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class LidarNoiseConfig:
    """Levels of the errors. The defaults are those of a cheap 12 m lidar indoors."""

    range_sigma_m: float = 0.02
    """Gaussian error of a range, one sigma: the part that does not grow."""
    range_sigma_share: float = 0.005
    """Gaussian error of a range, one sigma: the part that grows with it."""
    quantum_m: float = 0.001
    """Ranges come in steps of this; 0 for none."""
    dropout_rate: float = 0.01
    """Share of beams that fail and say nothing (nan)."""
    short_rate: float = 0.005
    """Share of beams that come back early, from the glossy floor or from dust."""
    miss_rate: float = 0.005
    """Share of beams that never come back although something is there: glass, black cloth (inf)."""

    def __post_init__(self) -> None:
        for name in ("range_sigma_m", "range_sigma_share", "quantum_m"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must not be negative, got {getattr(self, name)}")
        for name in ("dropout_rate", "short_rate", "miss_rate"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} must be a share from 0 to 1, got {getattr(self, name)}")

    def scaled(self, factor: float) -> LidarNoiseConfig:
        """Every error multiplied; 0 leaves exact ranges."""
        if not 0.0 <= factor < math.inf:
            raise ValueError(f"a noise scale must not be negative, got {factor}")
        return replace(
            self,
            range_sigma_m=self.range_sigma_m * factor,
            range_sigma_share=self.range_sigma_share * factor,
            quantum_m=self.quantum_m * factor,
            dropout_rate=min(1.0, self.dropout_rate * factor),
            short_rate=min(1.0, self.short_rate * factor),
            miss_rate=min(1.0, self.miss_rate * factor),
        )


@dataclass(frozen=True)
class LidarStreams:
    """One random stream a source of error, so that changing one leaves the others as they were."""

    range_error: np.random.Generator
    dropout: np.random.Generator
    short: np.random.Generator
    miss: np.random.Generator

    @staticmethod
    def spawned(rng: np.random.Generator) -> LidarStreams:
        """Four independent children of one generator."""
        return LidarStreams(*rng.spawn(4))


class LidarNoise:
    """Spoils exact ranges. Every source draws the same amount each scan, whatever its level."""

    def __init__(self, config: LidarNoiseConfig, streams: LidarStreams) -> None:
        self.config = config
        self._streams = streams

    def spoil(self, exact_m: Floats, min_range_m: float, max_range_m: float) -> Floats:
        """(n,) measured ranges: at or beyond max_range_m they are inf, of failed beams nan."""
        config, streams, count = self.config, self._streams, len(exact_m)
        reach_m = np.minimum(exact_m, max_range_m)
        sigma_m = config.range_sigma_m + config.range_sigma_share * reach_m
        measured = reach_m + sigma_m * streams.range_error.standard_normal(count)
        measured[exact_m > max_range_m] = math.inf

        chance = streams.short.random(count)
        short = np.flatnonzero(chance < config.short_rate)
        if len(short):
            place = chance[short] / config.short_rate  # below the rate, chance is uniform still
            measured[short] = min_range_m + place * np.maximum(reach_m[short] - min_range_m, 0.0)
        measured[streams.miss.random(count) < config.miss_rate] = math.inf

        if config.quantum_m > 0.0:
            measured = np.rint(measured / config.quantum_m) * config.quantum_m
        np.maximum(measured, 0.0, out=measured)
        measured[measured >= max_range_m] = math.inf
        measured[streams.dropout.random(count) < config.dropout_rate] = math.nan
        return measured
