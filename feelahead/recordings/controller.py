"""Read and write a recording's entries of the controller: values, or in older recordings a DualSense's reports."""

from typing import Final, TypeVar

import msgspec

from common.errors import RemoteProtocolError
from common.recording.entries import Kind
from operator_side.controller.feel import Feel
from operator_side.controller.state import ControllerState
from operator_side.dualsense.reports.input_report import parse_input_report
from operator_side.dualsense.reports.output_report import build_output_report, parse_output_report

_Value = TypeVar("_Value")
STATES: Final = (Kind.HANDS, Kind.REPORT)
"""Kinds of entries with a state of the controller: as a value, and as a report"""
FEELS: Final = (Kind.TOLD, Kind.WRITTEN)
"""Kinds of entries with effects for the controller: as a value, and as a report"""


def recorded_state(kind: int, content: bytes) -> ControllerState:
    """Read an entry whose kind is one of STATES; raises RemoteProtocolError if it is invalid."""
    return parse_input_report(content) if kind == Kind.REPORT else _read(content, ControllerState)


def recorded_feel(kind: int, content: bytes) -> Feel:
    """Read an entry whose kind is one of FEELS; raises RemoteProtocolError if it is invalid."""
    return parse_output_report(content) if kind == Kind.WRITTEN else _read(content, Feel)


def _read(content: bytes, kind: type[_Value]) -> _Value:
    try:
        return msgspec.msgpack.decode(content, type=kind)
    except msgspec.MsgspecError as error:
        raise RemoteProtocolError(f"a recorded {kind.__name__} is invalid: {error}") from error


def as_recorded(kind: int, feel: Feel) -> bytes:
    """Pack `feel` as the content of an entry of `kind`, which is one of FEELS."""
    return build_output_report(feel) if kind == Kind.WRITTEN else msgspec.msgpack.encode(feel)
