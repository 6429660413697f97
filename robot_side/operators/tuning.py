"""Changes that the lease's owner may make during a run: the probability P of eq. 10, and the emulated link."""

from collections import deque
from collections.abc import Callable
from typing import Any, Final

from common.emulation.tuned import tunable_profile
from common.errors import ConfigurationError
from common.protocol.messages import Tune

_REMEMBERED: Final = 1000
_NOTES: Final = 20


class Tuning:
    """Grants requests to tune if the run permits it; stores granted requests with their times, counts the refused."""

    def __init__(self, probability: float | None = None, expect: Callable[[float], None] | None = None) -> None:
        """probability: P at the start. expect: called with each new P; None: the run permits no tuning."""
        self.probability = probability
        """Present probability P"""
        self.refused = 0
        self._expect = expect
        self._start_s: float | None = None
        self._granted: deque[dict[str, Any]] = deque(maxlen=_REMEMBERED)
        self._notes: deque[str] = deque(maxlen=_NOTES)
        self._link: str | None = None
        self._refused_because = ""

    @property
    def permitted(self) -> bool:
        """Whether the run permits tuning"""
        return self._expect is not None

    def begin(self, now_s: float) -> None:
        """Set the start of the run; only the first call counts."""
        if self._start_s is None:
            self._start_s = now_s

    def grant(self, tune: Tune, now_s: float, *, owns: bool) -> bool:
        """Grant a request as a whole, or refuse it; return whether it was granted. owns: whether the owner sent it."""
        if self._expect is None or not owns:
            why = (
                "only the owner of the robot may tune"
                if self.permitted
                else "the robot side permits it with --permit-tuning only"
            )
            return self._refuse(why)
        try:
            if tune.link is not None:
                tunable_profile(tune.link)
        except ConfigurationError as error:
            return self._refuse(str(error))
        if tune.probability is not None and tune.probability != self.probability:
            self._expect(tune.probability)
            self.probability = tune.probability
        if tune.link is not None:
            self._link = tune.link
        words = [] if tune.probability is None else [f"P = {tune.probability:g}"]
        words += [] if tune.link is None else [f"link {tune.link or 'not emulated'!r}"]
        self._notes.append(f"tuned: {', '.join(words) or 'nothing'}")
        time_s = 0.0 if self._start_s is None else now_s - self._start_s
        self._granted.append({"time_s": time_s, "probability": tune.probability, "link": tune.link})
        return True

    def _refuse(self, why: str) -> bool:
        self.refused += 1
        if why != self._refused_because:  # one note for repeated requests
            self._refused_because = why
            self._notes.append(f"tuning refused: {why}")
        return False

    def take_link(self) -> str | None:
        """Return the emulated link granted since the last call, for this side's messages; None if none was granted."""
        link, self._link = self._link, None
        return link

    def take_notes(self) -> list[str]:
        """Return the notes made since the last call, for a person to read."""
        notes = list(self._notes)
        self._notes.clear()
        return notes

    def summary(self) -> dict[str, Any]:
        """Return the granted requests, with their times, and the number of refused requests."""
        return {"permitted": self.permitted, "granted": list(self._granted), "refused": self.refused}
