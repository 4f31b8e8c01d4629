"""What a lidar gets wrong, one source at a time, each with its own chance."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, replace

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
        from sim import lidar_kernels  # compiled on first use, not on import

        self.config = config
        self._streams = streams
        self._spoil = lidar_kernels.spoil
        self._levels = astuple(config)

    def spoil(self, exact_m: Floats, min_range_m: float, max_range_m: float) -> Floats:
        """(n,) measured ranges: at or beyond max_range_m they are inf, of failed beams nan."""
        streams, count = self._streams, len(exact_m)
        normal = streams.range_error.standard_normal(count)
        short, miss = streams.short.random(count), streams.miss.random(count)
        dropout = streams.dropout.random(count)
        return self._spoil(exact_m, normal, short, miss, dropout, self._levels, min_range_m, max_range_m)
