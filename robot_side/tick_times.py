"""Durations of ticks and of their physics, and the arm's simulated time as a share of real time."""

from collections import deque
from collections.abc import Callable
from typing import Any, Final

from common.clock import Clock
from common.command.live_view import SLOW
from common.loop.loop import Loop
from common.statistics import RunningStatistics, microseconds
from robot_side.arm.port import Arm
from robot_side.tick.events import Listener, Step

_LATEST: Final = 1000


class PhysicsTime(Listener):
    """Measures how long the arm's state takes in each tick: a simulated arm advances its physics there."""

    steps = ("arm", "pose")

    def __init__(self, clock: Clock, seed: int) -> None:
        self.took = RunningStatistics(seed)
        self._clock, self._began_s = clock, 0.0

    def on_step(self, step: Step) -> None:
        """Begin with the step `arm`, and end with the next one."""
        if step == "arm":
            self._began_s = self._clock.now()
        else:
            self.took.add(self._clock.now() - self._began_s)


class TickTimes:
    """Measures the duration of each tick; `paced` returns the figures of the ticks since its last call."""

    def __init__(self, loop: Loop, arm: Arm, physics: PhysicsTime, note: Callable[[str], None], seed: int) -> None:
        """note: called once if the simulation does not keep up with real time."""
        self._loop, self._arm, self._physics, self._note = loop, arm, physics, note
        self._wall, self._processor = RunningStatistics(seed), RunningStatistics(seed)
        self._latest_s: deque[float] = deque(maxlen=_LATEST)
        self._told_slow = False

    def begin(self) -> tuple[float, float]:
        """Return the readings of the wall clock and of the processor clock, for `end`."""
        return self._loop.clock.now(), self._loop.computed.now()

    def end(self, began: tuple[float, float]) -> float:
        """Count a tick; return its wall time in seconds."""
        self._processor.add(self._loop.computed.now() - began[1])
        took_s = self._loop.clock.now() - began[0]
        self._wall.add(took_s)
        self._latest_s.append(took_s)
        return took_s

    def paced(self) -> dict[str, float | int]:
        """Return figures for the status, of the ticks since the last call."""
        share = self._arm.take_share_of_real_time()
        if max(share, self._arm.share_of_real_time) < SLOW and not self._told_slow:
            self._told_slow = True
            self._note(
                f"the simulation runs at {100.0 * share:.0f} % of real time: fewer free bodies, a longer timestep or"
                ' <flag sleep="enable"/> in the model would help'
            )
        latest_s = sorted(self._latest_s) or [0.0]
        self._latest_s.clear()
        return {
            "tick_us": 1e6 * latest_s[len(latest_s) // 2],
            "tick_p99_us": 1e6 * latest_s[len(latest_s) * 99 // 100],
            "period_ms": 1e3 * self._loop.pacer.period_s,
            "overruns": self._loop.pacer.overruns,
            "late_us": 1e6 * self._loop.pacer.take_latest_s(),
            "real_time": share,
        }

    def summary(self) -> dict[str, Any]:
        """Return the figures of all ticks of the run."""
        return {
            "tick_us": microseconds(self._wall),
            "tick_cpu_us": microseconds(self._processor),
            "physics_us": microseconds(self._physics.took),
            "simulation": {"share_of_real_time": self._arm.share_of_real_time},
        }
