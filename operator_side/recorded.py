"""An operator side that notes every call of its core and what it answered, to be made again bit for bit."""

import functools
from collections.abc import Callable
from typing import Any, Final

import msgspec

from common.clock import clock_domain
from common.protocol.codec import MAXIMUM_BYTES
from common.recording.entries import Kind, entry, text
from common.recording.provenance import provenance
from common.recording.side import SideRecording
from operator_side.assembly import build_operator_side
from operator_side.commanding import StopButton, ToRobot
from operator_side.core import OperatorSide
from operator_side.dualsense.reports.output_report import OutputReport, build_output_report
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.settings import OperatorSettings

Note = Callable[[Any], None]
_HAPTICS: Final = text(b"haptics")
_NOBODY: Final = text(b"")


class RecordedOperatorSide(OperatorSide):
    """As the one that it extends; `note` takes what happened."""

    def __init__(self, note: Note, epoch: int, clock_domain: str, **settings: Any) -> None:
        super().__init__(epoch, clock_domain, **settings)
        self._note = note
        self._now_s = 0.0
        self.stop_button = _NotedStop(note)

    def receive(self, payload: bytes, now_s: float) -> None:
        """As the core's."""
        self._note((Kind.RECEIVED, now_s, payload))
        super().receive(payload, now_s)

    def receive_view(self, payload: bytes, now_s: float) -> None:
        """As the core's."""
        self._note((Kind.SEEN, now_s, payload))
        super().receive_view(payload, now_s)

    def read_report(self, report: bytes, now_s: float) -> None:
        """As the core's."""
        self._note((Kind.REPORT, now_s, report))
        super().read_report(report, now_s)

    def tune(self, probability: float | None, link: str | None, now_s: float) -> None:
        """As the core's."""
        self._note((Kind.TUNED, now_s, msgspec.json.encode({"probability": probability, "link": link})))
        super().tune(probability, link, now_s)

    def calibrate(self, calibration: TravelCalibration) -> None:
        """As the core's, which asks for no time: it happened after the last call that had one."""
        self._note((Kind.CALIBRATED, self._now_s, msgspec.json.encode(calibration)))
        super().calibrate(calibration)

    def controller_found(self, now_s: float) -> None:
        """As the core's."""
        self._note((Kind.FOUND, now_s, b""))
        super().controller_found(now_s)

    def controller_lost(self, now_s: float) -> None:
        """As the core's."""
        self._note((Kind.LOST, now_s, b""))
        super().controller_lost(now_s)

    def motion(self, now_s: float) -> list[ToRobot]:
        """As the core's."""
        messages = super().motion(now_s)
        self._note((Kind.MOTION, now_s, messages))
        return messages

    def output_report(self, now_s: float) -> OutputReport | None:
        """As the core's."""
        self._now_s = now_s
        report = super().output_report(now_s)
        self._note((Kind.OUTPUT, now_s, report))
        return report


class _NotedStop(StopButton):
    """A stop that was pressed away from the controller."""

    def __init__(self, note: Note) -> None:
        super().__init__()
        self._note = note

    def press(self, now_s: float) -> None:
        self._note((Kind.STOPPED, now_s, b""))
        super().press(now_s)


class OperatorEncoder:
    """Turns these notes into entries."""

    def begin_anew(self) -> None:
        """Each entry is whole."""

    def encode(self, noted: Any, views: Callable[[float, bytes], None]) -> tuple[float, bytes]:
        """When it happened, and its entries; view payloads go to `views`, too."""
        kind, now_s, content = noted
        if kind == Kind.MOTION:
            sent = [entry(Kind.SENT, now_s, _HAPTICS, _NOBODY, message.payload) for message in content]
            return now_s, b"".join((entry(kind, now_s), *sent))
        if kind == Kind.OUTPUT:
            asked = entry(kind, now_s)
            written = b"" if content is None else entry(Kind.WRITTEN, now_s, build_output_report(content))
            return now_s, asked + written
        if kind == Kind.RECEIVED:
            return now_s, entry(kind, now_s, _NOBODY, content)
        if kind == Kind.SEEN:
            views(now_s, content)
            # A longer one is no message that the core heeds, but a picture.
            return now_s, entry(kind, now_s, content) if len(content) <= MAXIMUM_BYTES else b""
        return now_s, entry(kind, now_s, content)


def build_recorded(settings: OperatorSettings, epoch: int, recording: SideRecording | None) -> OperatorSide:
    """The core of `settings`, whose calls go to `recording` where there is one."""
    core = build_operator_side(settings, epoch, clock_domain(), recorded_by(recording))
    if recording is not None:
        recording.begin(provenance(settings, epoch, clock_domain()))
    return core


def recorded_by(recording: SideRecording | None) -> Callable[..., OperatorSide]:
    """What makes a core whose calls go to `recording`; the plain one without a recording."""
    return OperatorSide if recording is None else functools.partial(RecordedOperatorSide, recording.noted.append)


def recorded_status(core: OperatorSide, now_s: float) -> dict[str, Any]:
    """What a person is shown, and the offset of the robot side's clock."""
    return core.status(now_s) | {"offset_s": core.link.clock_offset.offset_at(now_s)}
