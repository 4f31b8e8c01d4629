"""Which submaps stay ready to be searched and matched: those used last."""

from __future__ import annotations

from collections import OrderedDict

from occmap.localization.submap import Submap


class ReadySubmaps:
    """Lets only so many finished submaps keep their working memory; others build it again when needed."""

    def __init__(self, submaps: list[Submap], most: int) -> None:
        self._submaps, self._most = submaps, most
        self._used: OrderedDict[int, None] = OrderedDict()  # the one used last at the end

    def use(self, submap: int) -> Submap:
        """Return a submap; the one used longest ago gives up its memory for it."""
        self._used[submap] = None
        self._used.move_to_end(submap)
        if len(self._used) > self._most:
            self._submaps[self._used.popitem(last=False)[0]].release()
        return self._submaps[submap]
