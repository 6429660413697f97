"""Simulation of a robot side that sends haptics, telemetry and dummy pictures through a slow link, in virtual time."""

import itertools
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from common.protocol.link_end import LinkEnd
from common.protocol.messages import Watch
from common.rate.budget import Budget, on_the_wire
from common.rate.pieces import Joining
from robot_side.viewing.picture_rate_control import PictureRateControl

TURN_S = 0.001
_VIEWS = 2
_BEHIND_S = 0.03
_LIMIT_BYTES = 1 << 22

Steady = Callable[[float], float]


class Way(Protocol):
    """Interface of one direction of a link, the same as that of DelayLine."""

    def push(self, now_s: float, item: Any, size_bytes: int | None = None) -> None: ...

    def pop(self, now_s: float) -> list[Any]: ...


class Bottleneck:
    """Drop-tail queue before a link of limited rate, then a delay. Packet headers count.

    `bit_s` gives the rate at each time.
    """

    def __init__(self, bit_s: Steady, queue_s: float = 0.2, delay_s: float = 0.025) -> None:
        """queue_s: seconds that a full queue takes to empty at the initial rate, which gives its capacity."""
        self._bit_s, self._delay_s = bit_s, delay_s
        self._most_bits = queue_s * bit_s(0.0)
        self._free_s = 0.0
        self._under_way: deque[tuple[float, Any]] = deque()

    def push(self, now_s: float, item: Any, size_bytes: int | None = None) -> None:
        if self.waits_s(now_s) * self._bit_s(now_s) <= self._most_bits:
            self._free_s = max(self._free_s, now_s) + 8.0 * on_the_wire(size_bytes or 0) / self._bit_s(now_s)
            self._under_way.append((self._free_s + self._delay_s, item))

    def pop(self, now_s: float) -> list[Any]:
        due = []
        while self._under_way and self._under_way[0][0] <= now_s:
            due.append(self._under_way.popleft()[1])
        return due

    def waits_s(self, now_s: float) -> float:
        """Return the queueing delay of a message that enters now, in seconds."""
        return max(0.0, self._free_s - now_s)


@dataclass
class Ran:
    delays_s: list[tuple[float, float]] = field(default_factory=list)
    """(time of sending, delay) of each haptic message, in seconds"""
    rates_bit_s: list[float] = field(default_factory=list)
    """Rate that the controller set in each turn"""
    pictures: list[tuple[float, float]] = field(default_factory=list)
    """(time of complete arrival, age) of each picture, in seconds"""
    budget: Budget[str] = field(default_factory=lambda: Budget(("video", "scene")))
    picture_rate_control: PictureRateControl = field(default_factory=lambda: PictureRateControl(30.0, 75))

    def delay_s(self, share: float, since_s: float = 0.0, until_s: float = math.inf) -> float:
        """Return the quantile `share` of the delays of haptic messages sent between `since_s` and `until_s`."""
        seen = sorted(delay_s for at_s, delay_s in self.delays_s if since_s <= at_s < until_s)
        return seen[min(len(seen) - 1, int(share * len(seen)))]

    def late_until_s(self, limit_s: float, since_s: float) -> float:
        """Return when the last haptic message with a delay above `limit_s` arrived; `since_s` if none did after it."""
        return max(
            (at_s + delay_s for at_s, delay_s in self.delays_s if at_s + delay_s > since_s and delay_s > limit_s),
            default=since_s,
        )


class _Sides:
    """What both sides send: haptics, telemetry, commands, pictures of two views, and the scene."""

    def __init__(self, out: Way, back: Way, drift: float) -> None:
        self.ran = Ran()
        self._out, self._back, self._drift = out, back, drift
        self._robot, self._operator = LinkEnd("robot", 1, "robot"), LinkEnd("operator", 2, "operator")
        self._number = itertools.count()
        self._next_s: dict[str | int, float] = {}
        self._joining = {"video": Joining(_LIMIT_BYTES), "scene": Joining(_LIMIT_BYTES)}
        self._shown_s: dict[bytes, float] = {}
        out.push(0.0, ("haptics", self._robot.hello(0.0)), 100)
        back.push(0.0, self._operator.hello(self._there_s(0.0)), 100)

    def _there_s(self, now_s: float) -> float:
        return now_s * (1.0 + self._drift) + 1234.5

    def _due(self, name: str | int, period_s: float, now_s: float) -> bool:
        if now_s < self._next_s.get(name, 0.0):
            return False
        self._next_s[name] = now_s + period_s
        return True

    def take(self, now_s: float) -> None:
        for kind, content in self._out.pop(now_s):
            if kind == "haptics":
                self.ran.delays_s.append((content.header.sent_s, now_s - content.header.sent_s))
                self._operator.arrived(content, self._there_s(now_s))
            elif kind in self._joining:
                is_piece, payload = content
                whole = self._joining[kind].add(payload) if is_piece else payload
                if whole is not None and kind == "video":
                    self.ran.pictures.append((now_s, now_s - self._shown_s[whole[:8]]))
        for content in self._back.pop(now_s):
            self._robot.arrived(content, now_s)
        self.ran.budget.hear(self._robot.outgoing, now_s)

    def feel(self, now_s: float) -> None:
        budget = self.ran.budget
        if self._due("haptics", max(0.01, budget.haptic_interval_s), now_s):
            budget.spend("haptics", 200, now_s)
            self._out.push(now_s, ("haptics", Watch(self._robot.stamp(now_s))), 200)
        if self._due("telemetry", 0.02, now_s) and budget.may_send_telemetry(160, now_s):
            self._out.push(now_s, ("telemetry", None), 160)
        if self._due("command", 0.01, now_s):
            self._back.push(now_s, Watch(self._operator.stamp(self._there_s(now_s))), 100)

    def show(self, now_s: float) -> None:
        """Make the pictures and the scene that are due, unless earlier ones still wait to be sent."""
        budget, picture_rate_control = self.ran.budget, self.ran.picture_rate_control
        step = picture_rate_control.update(budget.left_bit_s, _VIEWS, now_s, eager=budget.controller.begins)
        for view in range(_VIEWS):
            self._next_s.setdefault(view, now_s + view * 0.5 / step.rate_hz)
            if budget.waiting_s("video") < _BEHIND_S and self._due(view, 1.0 / step.rate_hz, now_s):
                size_bytes = int(15_000 * step.bytes_share())
                picture_rate_control.made(size_bytes, step)
                name = next(self._number).to_bytes(8)
                self._shown_s[name] = now_s
                budget.offer("video", name.ljust(size_bytes, b"p"), now_s)
        if budget.waiting_s("scene") < _BEHIND_S and self._due("scene", 1.0 / 30.0, now_s):
            budget.offer("scene", b"s" * 1500, now_s)

    def leave(self, now_s: float) -> None:
        """Send the pieces of pictures and scene that the budget allows now."""
        for stream, payload, is_piece in self.ran.budget.take(now_s):
            self._out.push(now_s, (stream, (is_piece, payload)), len(payload))
        self.ran.rates_bit_s.append(self.ran.budget.controller.rate_bit_s)


def run(out: Way, back: Way, seconds: float, *, drift: float = 0.0, others_s: float = 0.0) -> Ran:
    """Run both sides for `seconds`; pictures begin after 1 s.

    drift: seconds that the operator's clock gains in one second. others_s: queueing delay that a bulk transfer causes
    from 5 s on.
    """
    sides = _Sides(out, back, drift)
    for turn in range(int(seconds / TURN_S)):
        now_s = turn * TURN_S
        sides.take(now_s)
        if now_s >= 5.0 and isinstance(out, Bottleneck) and out.waits_s(now_s) < others_s:
            out.push(now_s, ("others", None), 1400)
        sides.feel(now_s)
        if now_s >= 1.0:
            sides.show(now_s)
        sides.leave(now_s + 0.5 * TURN_S)
    return sides.ran
