"""Run the operator side's core again with its recorded inputs, and compare its output with the recorded one."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Final

import msgspec

from common.recording.entries import Kind, split_text
from common.recording.provenance import settings_from
from common.recording.reading import Recording
from feelahead.recordings.comparison import Comparison, recorded_entries, require_side
from feelahead.recordings.controller import read_value
from operator_side.assembly import build_operator_side
from operator_side.controller.state import ControllerState
from operator_side.core import OperatorSide
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.settings import OperatorSettings

_INPUTS: Final[Mapping[int, Callable[[OperatorSide, bytes, float], object]]] = {
    Kind.RECEIVED: lambda core, content, now_s: core.receive(split_text(content)[1], now_s),
    Kind.SEEN: OperatorSide.receive_view,
    Kind.CALIBRATED: lambda core, content, _: core.calibrate(msgspec.json.decode(content, type=TravelCalibration)),
    Kind.FOUND: lambda core, _, now_s: core.controller_found(now_s),
    Kind.LOST: lambda core, _, now_s: core.controller_lost(now_s),
    Kind.WATCHED: lambda core, _, now_s: core.link.stamp(now_s),
    Kind.STOPPED: lambda core, _, now_s: core.press_stop(now_s),
    Kind.MARKED: lambda core, content, now_s: core.marker.mark(msgspec.json.decode(content), now_s),
    Kind.TUNED: lambda core, content, now_s: core.tune(**msgspec.json.decode(content), now_s=now_s),
}
"""For each kind of entry, the call that gives the recorded input to the operator side's core."""


def replay_operator(recording: Recording) -> Comparison:
    """Compute the motion commands and the effects for the controller again, and compare them with the recorded ones.

    Raises ConfigurationError if the side was not recorded.
    """
    header = require_side(recording, "operator")
    settings = settings_from(header["settings"], OperatorSettings)
    core = build_operator_side(settings, header["epoch"], header["clock_domain"])
    compared = Comparison("operator", "commands and reports to the controller")
    sent: deque[bytes] = deque()
    feels: deque[bytes] = deque()
    for entry in recorded_entries(recording, "operator", compared.notes):
        now_s, content = entry.now_s, entry.content
        if (give := _INPUTS.get(entry.kind)) is not None:
            give(core, content, now_s)
        match entry.kind:
            case Kind.HANDS:
                core.read_state(read_value(content, ControllerState), now_s)
            case Kind.TOLD:
                compared.compare(content, feels.popleft() if feels else None, feel=True)
            case Kind.MOTION:
                compared.missed(sent)
                sent.extend(message.payload for message in core.motion(now_s))
            case Kind.OUTPUT:
                compared.missed(feels, feel=True)
                if (feel := core.feel_now(now_s)) is not None:
                    feels.append(msgspec.msgpack.encode(feel))
            case Kind.SENT:
                payload = split_text(split_text(content)[1])[1]
                compared.compare(payload, sent.popleft() if sent else None)
    compared.missed(sent)
    compared.missed(feels, feel=True)
    return compared
