"""Measure the path to a robot side for five seconds, with the traffic of a resting operator, and say what it carries.

The doctor rests its hands, and asks for both views. Where the arm is free it holds the lease meanwhile, disarmed; where
somebody drives it observes. The robot side's own rate control then fits the pictures to the path.
"""

import importlib.util
import secrets
from collections import defaultdict
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

from common.clock import MonotonicClock, clock_domain
from common.errors import RemoteProtocolError
from common.protocol.codec import VIEW_MAXIMUM_BYTES, decode_view, encode
from common.protocol.messages import Watch
from common.protocol.view_messages import VIDEO_TOPIC, VideoFrame, VideoStep
from common.rate.pieces import PIECE, Joining
from common.sockets.operator import OperatorSockets
from common.sockets.tcp_figures import TcpFigures, connected_to, tcp_figures
from feelahead.commands.doctor.link_facts import Way
from operator_side.core import CoreSettings, OperatorSide
from operator_side.dualsense.simulated.controller import SimulatedDualSense

MEASURE_S: Final = 5.0
_SETTLE_S: Final = 2.0
"""Before the five seconds: for the handshakes, the estimate of the clocks, and the pictures' rate."""
_STEP_S: Final = 0.004
_WATCH_PERIOD_S: Final = 0.25
_GAP_S: Final = 0.1
"""A silence of the robot's commands beyond this stops the arm."""
_LEAST_PICTURES_HZ: Final = 4.0
_OLDEST_PICTURE_S: Final = 0.5


@dataclass(frozen=True)
class PathFacts:
    """The figures of five seconds; None for what could not be measured."""

    linked: bool
    """Whether the robot side answered throughout."""
    round_trip_s: tuple[float, float] | None = None
    """The median and the 95 % quantile."""
    queue_s: float | None = None
    """The 95 % quantile of the delay to here, above the least."""
    longest_gap_s: float | None = None
    """Between two messages of the robot side."""
    received_bits_s: float = 0.0
    sent_again: float | None = None
    """The share of our packets that the kernel had to send again, 0 to 1."""
    pictures: tuple[tuple[str, float, float | None], ...] = ()
    """(view, pictures a second, the 95 % quantile of their age in seconds) of each view that came."""

    @property
    def arm_works(self) -> bool:
        """Whether a link like this keeps the arm armed: no silence as long as the gap limit."""
        return self.linked and self.longest_gap_s is not None and self.longest_gap_s < _GAP_S

    @property
    def views_that_work(self) -> int:
        """How many views come often and young enough to look at while driving."""
        return sum(rate >= _LEAST_PICTURES_HZ and (age or 0.0) <= _OLDEST_PICTURE_S for _, rate, age in self.pictures)


@dataclass
class _Arrivals:
    """What arrived within the five seconds."""

    times_s: list[float] = field(default_factory=list)
    bytes: int = 0
    pictures: dict[str, list[tuple[float, float]]] = field(default_factory=lambda: defaultdict(list))
    """(received, captured) of each view's pictures, on both sides' clocks"""


def measure_path_along(way: Way) -> PathFacts:
    """Measure the path to a robot side that answers."""
    control, view = way.ports()
    topics = (b"telemetry", VIDEO_TOPIC)
    with OperatorSockets(control.address, view.address, topics=topics, keys=way.keys) as sockets:
        return _measured(sockets, (control.port, view.port), MonotonicClock())


def _measured(sockets: OperatorSockets, ports: tuple[int, int], clock: MonotonicClock) -> PathFacts:
    core = OperatorSide(secrets.randbits(53), clock_domain(), CoreSettings(haptics=False))
    hands = SimulatedDualSense()
    begin_s = clock.now() + _SETTLE_S
    end_s, watch_s = begin_s + MEASURE_S, 0.0
    arrivals, before, settled, joining = _Arrivals(), TcpFigures(), False, Joining(VIEW_MAXIMUM_BYTES)
    # Ask for what the console would be sent.
    lacks = (0, 0) if importlib.util.find_spec("av") is not None else None
    while True:
        received, seen = sockets.receive(), sockets.receive_view()
        now_s = clock.now()
        if now_s >= end_s:
            return _facts(core, arrivals, _sent(ports).since(before), begin_s)
        if not settled and now_s >= begin_s:
            settled, before = True, _sent(ports)
        for payload in received:
            core.receive(payload, now_s)
            arrivals.times_s.append(now_s)
        if settled:
            arrivals.bytes += sum(map(len, received)) + sum(len(payload) for _, payload in seen)
        for topic, payload in seen:
            whole = joining.take(payload) if topic == VIDEO_TOPIC + PIECE else payload
            if settled and whole is not None and topic.startswith(VIDEO_TOPIC):
                _note_picture(whole, arrivals, now_s)
        if (state := hands.read(now_s)) is not None:
            core.read_state(state, now_s)
        for leaving in core.motion(now_s):
            sockets.send(leaving.payload, everywhere=leaving.everywhere)
        if now_s >= watch_s:
            watch_s = now_s + _WATCH_PERIOD_S
            sockets.send(encode(Watch(core.link.stamp(now_s), overview=True, first_person=True, lacks=lacks)))
        sockets.wait(_STEP_S)


def _sent(ports: tuple[int, int]) -> TcpFigures:
    return tcp_figures([one for port in ports for one in connected_to(port)])


def _note_picture(payload: bytes, arrivals: _Arrivals, now_s: float) -> None:
    try:
        frame = decode_view(payload)
    except RemoteProtocolError:
        return
    if isinstance(frame, VideoFrame | VideoStep):
        arrivals.pictures[frame.view].append((now_s, frame.captured_s))


def _facts(core: OperatorSide, arrivals: _Arrivals, sent: TcpFigures, begin_s: float) -> PathFacts:
    recent = [arrival for arrival in core.link.recent if arrival[0] >= begin_s]
    trips_s = [both_s for _, _, both_s in recent if both_s is not None]
    there_s = [one_s for _, one_s, _ in recent if one_s is not None]
    times_s = [time_s for time_s in arrivals.times_s if time_s >= begin_s]
    offset_s = core.link.clock_offset.offset_s
    pictures = []
    for view, seen in sorted(arrivals.pictures.items()):
        ages_s = [] if offset_s is None else [came_s - (taken_s - offset_s) for came_s, taken_s in seen]
        pictures.append((view, len(seen) / MEASURE_S, _quantile(ages_s, 0.95)))
    middle_s, high_s, slow_s = _quantile(trips_s, 0.5), _quantile(trips_s, 0.95), _quantile(there_s, 0.95)
    return PathFacts(
        linked=core.lease is not None,
        round_trip_s=None if middle_s is None or high_s is None else (middle_s, high_s),
        queue_s=None if slow_s is None else slow_s - min(there_s),
        longest_gap_s=max(after - before for before, after in pairwise([begin_s, *times_s, begin_s + MEASURE_S])),
        received_bits_s=8.0 * arrivals.bytes / MEASURE_S,
        sent_again=sent.lost_share,
        pictures=tuple(pictures),
    )


def _quantile(values: list[float], share: float) -> float | None:
    return sorted(values)[min(int(share * len(values)), len(values) - 1)] if values else None


def path_line(path: PathFacts) -> str:
    """Say what was measured, and what will work on it."""
    if path.round_trip_s is None:
        return "path: nothing measured, as the robot side stopped answering"
    middle_s, high_s = path.round_trip_s
    said = [f"round trip {1e3 * middle_s:.0f} ms, 95 % within {1e3 * high_s:.0f} ms"]
    if path.queue_s is not None:
        said.append(f"queue {1e3 * path.queue_s:.0f} ms")
    if path.longest_gap_s is not None:
        said.append(f"longest silence {1e3 * path.longest_gap_s:.0f} ms")
    if path.sent_again is not None:
        said.append(f"{100.0 * path.sent_again:.1f} % of packets sent again")
    said.append(f"{1e-3 * path.received_bits_s:.0f} kbit/s came")
    for view, rate_hz, age_s in path.pictures:
        age = "" if age_s is None else f" up to {1e3 * age_s:.0f} ms old"
        said.append(f"{view.replace('_', ' ')} {rate_hz:.0f} pictures a second{age}")
    return f"path: {', '.join(said)}; {_verdict(path)}"


def _verdict(path: PathFacts) -> str:
    if not path.arm_works:
        return f"the arm will stop again and again: silences reach the limit of {1e3 * _GAP_S:.0f} ms"
    if not path.pictures:
        return "the arm works; no pictures came (a robot side with --no-cameras, or one that cannot render)"
    return f"what works: {('the arm alone', 'the arm and one view', 'the arm and both views')[path.views_that_work]}"


def path_told(path: PathFacts) -> dict[str, object]:
    """Tell the figures to programs."""
    middle_s, high_s = path.round_trip_s or (None, None)
    return {
        "round_trip_ms": {"p50": _ms(middle_s), "p95": _ms(high_s)},
        "queue_p95_ms": _ms(path.queue_s),
        "longest_silence_ms": _ms(path.longest_gap_s),
        "received_kbit_s": 1e-3 * path.received_bits_s,
        "sent_again": path.sent_again,
        "views": {view: {"rate_hz": rate_hz, "age_p95_ms": _ms(age_s)} for view, rate_hz, age_s in path.pictures},
        "arm_works": path.arm_works,
        "views_that_work": path.views_that_work,
    }


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else 1e3 * seconds
