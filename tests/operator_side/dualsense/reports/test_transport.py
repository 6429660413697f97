"""USB and Bluetooth are told apart by the reports themselves."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import RemoteProtocolError
from operator_side.dualsense.reports.transport import Transport, is_simple_report, transport_of_input


@pytest.mark.parametrize(
    ("report_id", "length", "transport", "simple"),
    [
        (0x01, 64, Transport.USB, False),
        (0x31, 78, Transport.BLUETOOTH, False),
        (0x01, 10, Transport.BLUETOOTH, True),
        (0x01, 78, Transport.BLUETOOTH, True),
    ],
)
def test_each_kind_of_input_report(report_id: int, length: int, transport: Transport, simple: bool) -> None:
    report = bytes([report_id]) + bytes(length - 1)
    assert transport_of_input(report) is transport
    assert is_simple_report(report) is simple


@given(st.integers(0, 255), st.integers(0, 130))
@settings(derandomize=True, deadline=None)
def test_any_other_id_or_length_is_named(report_id: int, length: int) -> None:
    report = (bytes([report_id]) + bytes(130))[:length]
    if (report_id, length) in ((0x01, 64), (0x31, 78), (0x01, 10), (0x01, 78)):
        return
    with pytest.raises(RemoteProtocolError, match=f"id 0x{report_id:02x}, {length} bytes;" if length else "no bytes;"):
        transport_of_input(report)
