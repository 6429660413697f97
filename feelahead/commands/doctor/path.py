"""Measurement of the path to a robot side for five seconds, with the traffic of a resting operator.

The doctor acts as an operator who touches nothing, and asks for both views. If the arm is free, the doctor holds the
lease during the measurement, disarmed. If another operator has the arm, the doctor observes. The robot side's rate
control adapts the pictures to the path.
"""

import importlib.util
import secrets
from collections import defaultdict
from itertools import pairwise
from typing import Any, Final

from common.clock import MonotonicClock, clock_domain
from common.errors import RemoteProtocolError
from common.protocol.codec import VIEW_MAXIMUM_BYTES, decode_view, encode
from common.protocol.messages import Watch
from common.protocol.view_messages import VIDEO_TOPIC, VideoFrame, VideoStep
from common.rate.pieces import PIECE, Joining
from common.sockets.operator import OperatorSockets
from common.sockets.tcp_figures import TcpFigures, connected_to, tcp_figures
from feelahead.commands.doctor.port import RobotAddress
from operator_side.core import OperatorSide
from operator_side.core_settings import CoreSettings
from operator_side.dualsense.simulated.controller import SimulatedDualSense

MEASURE_S: Final = 5.0
_SETTLE_S: Final = 2.0
"""Time before the measurement, in seconds, until handshakes, clock offset and the pictures' rate have settled."""
_STEP_S: Final = 0.004
_WATCH_PERIOD_S: Final = 0.25
_GAP_MS: Final = 100.0
"""Silence of commands after which the robot side stops the arm, in milliseconds."""
_LEAST_PICTURES_HZ: Final = 4.0
_OLDEST_PICTURE_MS: Final = 500.0


def measure_path(address: RobotAddress) -> dict[str, Any]:
    """Measure the path to a robot side that answers; return the figures by name, None for a figure without a value."""
    topics = (b"telemetry", VIDEO_TOPIC)
    with OperatorSockets(address.control.address, address.view.address, topics=topics, keys=address.keys) as sockets:
        return _measured(sockets, (address.control.port, address.view.port), MonotonicClock())


def _measured(sockets: OperatorSockets, ports: tuple[int, int], clock: MonotonicClock) -> dict[str, Any]:
    core = OperatorSide(secrets.randbits(53), clock_domain(), CoreSettings(haptics=False))
    hands, joining = SimulatedDualSense(), Joining(VIEW_MAXIMUM_BYTES)
    begin_s = clock.now() + _SETTLE_S
    end_s, watch_s, settled, before = begin_s + MEASURE_S, 0.0, False, TcpFigures()
    times_s, arrived_bytes = [begin_s], 0
    pictures: dict[str, list[tuple[float, float]]] = defaultdict(list)
    """For each view, (time received, time captured) of each picture; each time is on its own side's clock"""
    # Request pictures in the format that the console would request.
    lacks = (0, 0) if importlib.util.find_spec("av") is not None else None
    while True:
        received, seen = sockets.receive(), sockets.receive_view()
        if (now_s := clock.now()) >= end_s:
            break
        if not settled and now_s >= begin_s:
            settled, before = True, _sent(ports)
        for payload in received:
            core.receive(payload, now_s)
        if settled:
            times_s += [now_s] * len(received)
            arrived_bytes += sum(map(len, received)) + sum(len(payload) for _, payload in seen)
        for topic, payload in seen:
            whole = joining.add(payload) if topic == VIDEO_TOPIC + PIECE else payload
            if settled and whole is not None and (frame := _picture(whole)) is not None:
                pictures[frame.view].append((now_s, frame.captured_s))
        if (state := hands.read(now_s)) is not None:
            core.read_state(state, now_s)
        for leaving in core.motion(now_s):
            sockets.send(leaving.payload, everywhere=leaving.everywhere)
        if now_s >= watch_s:
            watch_s = now_s + _WATCH_PERIOD_S
            sockets.send(encode(Watch(core.link.stamp(now_s), overview=True, first_person=True, lacks=lacks)))
        sockets.wait(_STEP_S)
    recent = [arrival for arrival in core.link.recent if arrival[0] >= begin_s]
    trips_s = [both_s for _, _, both_s in recent if both_s is not None]
    there_s = [one_s for _, one_s, _ in recent if one_s is not None]
    offset_s = core.link.clock_offset.offset_s
    views = {}
    for view, taken in sorted(pictures.items()):
        ages_s = [] if offset_s is None else [came_s - (taken_s - offset_s) for came_s, taken_s in taken]
        views[view] = {"rate_hz": len(taken) / MEASURE_S, "age_p95_ms": _quantile_ms(ages_s, 0.95)}
    return judged(
        {
            "round_trip_ms": {"p50": _quantile_ms(trips_s, 0.5), "p95": _quantile_ms(trips_s, 0.95)},
            "queue_p95_ms": _quantile_ms([one_s - min(there_s) for one_s in there_s], 0.95),
            "longest_silence_ms": 1e3 * max(after - last for last, after in pairwise([*times_s, end_s])),
            "received_kbit_s": 8e-3 * arrived_bytes / MEASURE_S,
            "sent_again": _sent(ports).since(before).lost_share,
            "views": views,
        },
        linked=core.lease is not None,
    )


def judged(figures: dict[str, Any], *, linked: bool) -> dict[str, Any]:
    """Return the figures, and with them whether the arm would work on this path and how many views.

    linked: whether the robot side has answered.
    """
    views = figures["views"].values()
    return figures | {
        "arm_works": linked and figures["longest_silence_ms"] < _GAP_MS,
        "views_that_work": sum(
            one["rate_hz"] >= _LEAST_PICTURES_HZ and (one["age_p95_ms"] or 0.0) <= _OLDEST_PICTURE_MS for one in views
        ),
    }


def _sent(ports: tuple[int, int]) -> TcpFigures:
    return tcp_figures([one for port in ports for one in connected_to(port)])


def _picture(payload: bytes) -> VideoFrame | VideoStep | None:
    try:
        frame = decode_view(payload)
    except RemoteProtocolError:
        return None
    return frame if isinstance(frame, VideoFrame | VideoStep) else None


def _quantile_ms(values_s: list[float], share: float) -> float | None:
    return 1e3 * sorted(values_s)[min(int(share * len(values_s)), len(values_s) - 1)] if values_s else None


def path_line(path: dict[str, Any]) -> str:
    """Return a line with the figures, and with what the path is good enough for."""
    trip_ms = path["round_trip_ms"]
    if trip_ms["p50"] is None:
        return "path: nothing measured, as the robot side stopped answering"
    said = [f"round trip {trip_ms['p50']:.0f} ms, 95 % within {trip_ms['p95']:.0f} ms"]
    if path["queue_p95_ms"] is not None:
        said.append(f"queue {path['queue_p95_ms']:.0f} ms")
    said.append(f"longest silence {path['longest_silence_ms']:.0f} ms")
    if path["sent_again"] is not None:
        said.append(f"{100.0 * path['sent_again']:.1f} % of packets sent again")
    said.append(f"{path['received_kbit_s']:.0f} kbit/s came")
    for view, one in path["views"].items():
        age = "" if one["age_p95_ms"] is None else f" up to {one['age_p95_ms']:.0f} ms old"
        said.append(f"{view.replace('_', ' ')} {one['rate_hz']:.0f} pictures a second{age}")
    works = (
        f"what works: {('the arm alone', 'the arm and one view', 'the arm and both views')[path['views_that_work']]}"
    )
    if not path["arm_works"]:
        works = f"the arm will stop again and again: silences reach the limit of {_GAP_MS:.0f} ms"
    elif not path["views"]:
        works = "the arm works; no pictures came (a robot side with --no-cameras, or one that cannot render)"
    return f"path: {', '.join(said)}; {works}"
