"""Views that operators watch, by their Watch messages: each counts for a second after its arrival."""

import math

from common.protocol.messages import Watch

WATCH_S = 1.0
_PARTS = ("overview", "first_person", "scene")
_NOBODY: frozenset[str] = frozenset()


class Watchers:
    """Newest Watch message of each operator; the session passes on only those of the owner and of observers."""

    def __init__(self) -> None:
        self.scene_begun = 0
        """How many times somebody began to watch the scene"""
        self._newest_s = -math.inf
        self._watching: dict[int, tuple[Watch, float]] = {}

    def heard(self, epoch: int, watch: Watch, now_s: float) -> None:
        """Take one Watch message of the operator with this epoch."""
        self._newest_s = now_s
        before = self._watching.get(epoch)
        looked = before is not None and before[0].scene and now_s - before[1] < WATCH_S
        self.scene_begun += watch.scene and not looked
        self._watching[epoch] = watch, now_s

    def lacks(self, now_s: float) -> tuple[int, int] | None:
        """Return for both views the newest picture that a watcher lacks; None unless all their watchers show H.264."""
        looking = [
            watch.lacks
            for watch, heard_s in self._watching.values()
            if now_s - heard_s < WATCH_S and (watch.overview or watch.first_person)
        ]
        known = [lacks for lacks in looking if lacks is not None]
        if not known or len(known) < len(looking):
            return None
        first, second = (max(numbers) for numbers in zip(*known, strict=True))
        return first, second

    def pace(self, owner: int | None, now_s: float) -> tuple[float, bool, float]:
        """Return the limits `picture_hz`, infinite for none, `halved` and `scene_hz`, of the operator who drives.

        owner: its epoch. If it does not watch, the slowest viewer counts: no observer slows an operator's pictures.
        """
        watching = {epoch: watch for epoch, (watch, heard_s) in self._watching.items() if now_s - heard_s < WATCH_S}
        watches = [watching[owner]] if owner in watching else [*watching.values()]
        picture_hz = min((watch.picture_hz or math.inf for watch in watches), default=math.inf)
        scene_hz = min((watch.scene_hz or math.inf for watch in watches), default=math.inf)
        return picture_hz, any(watch.halved for watch in watches), scene_hz

    def looked_at(self, now_s: float) -> frozenset[str]:
        """Return which of `overview`, `first_person` and `scene` are watched."""
        if not self._watching:
            return _NOBODY
        for epoch in [epoch for epoch, (_, heard_s) in self._watching.items() if now_s - heard_s >= WATCH_S]:
            del self._watching[epoch]
        return frozenset(part for part in _PARTS for watch, _ in self._watching.values() if getattr(watch, part))

    def expected(self, now_s: float) -> bool:
        """Return whether a viewer may come soon: a Watch message, even one for no view, came less than a second ago."""
        return now_s - self._newest_s < WATCH_S
