"""An architect's sketch: which spaces there are and which of them are joined, before walls are drawn."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from sim.generators.spaces import Opening, Space, doorway, mouth


@dataclass
class Sketch:
    """Spaces, and pairs of them (by index) that a door or a corridor's mouth joins."""

    spaces: list[Space] = field(default_factory=list)
    doors: list[tuple[int, int]] = field(default_factory=list)
    mouths: list[tuple[int, int]] = field(default_factory=list)

    def add(self, space: Space) -> int:
        """The new space's index."""
        self.spaces.append(space)
        return len(self.spaces) - 1

    def rooms(self) -> list[int]:
        """Indices of the spaces that are no corridors."""
        return [k for k, space in enumerate(self.spaces) if space.is_room]

    def use(self, index: int, kind: str) -> None:
        """Say what a room is for."""
        self.spaces[index] = replace(self.spaces[index], kind=kind)

    def transposed(self) -> Sketch:
        """x and y exchanged: corridors that ran east run north."""
        return Sketch([Space(s.kind, s.y0, s.x0, s.y1, s.x1) for s in self.spaces], self.doors, self.mouths)

    def mirrored(self, width_m: float) -> Sketch:
        """West and east exchanged."""
        spaces = [
            Space(s.kind, round(width_m - s.x1, 3), s.y0, round(width_m - s.x0, 3), s.y1) for s in self.spaces
        ]
        return Sketch(spaces, self.doors, self.mouths)

    def openings(self, rng: np.random.Generator) -> list[Opening]:
        """Doorways at random places of their walls, and mouths; a door that does not fit is left out."""
        found = [mouth(self.spaces[a], self.spaces[b]) for a, b in self.mouths]
        found += [doorway(self.spaces[a], self.spaces[b], rng) for a, b in self.doors]
        return [opening for opening in found if opening is not None]
