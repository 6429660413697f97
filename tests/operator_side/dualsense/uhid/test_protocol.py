"""The protocol of /dev/uhid: the layout of linux/uhid.h, down to the byte."""

import contextlib
import struct
import subprocess
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from operator_side.dualsense.reports.report_descriptors import BLUETOOTH_DESCRIPTOR, USB_DESCRIPTOR
from operator_side.dualsense.uhid.protocol import (
    BUS_BLUETOOTH,
    BUS_USB,
    EVENT_LENGTH,
    FEATURE_REPORT,
    INPUT_REPORT,
    OUTPUT_REPORT,
    Closed,
    GetReport,
    Opened,
    Output,
    SetReport,
    Started,
    Stopped,
    UhidIdentity,
    create,
    destroy,
    get_report_reply,
    input_report,
    parse_event,
    set_report_reply,
)

HEADER = Path("/usr/include/linux/uhid.h")
IDENTITY = UhidIdentity(
    name="A controller",
    vendor_id=0x054C,
    product_id=0x0CE6,
    bus=BUS_BLUETOOTH,
    descriptor=b"\x05\x01\xc0",
    unique_id="aa:bb",
    physical_place="here",
    version=0x0102,
    country=3,
)


def number(event: bytes, start: int, length: int) -> int:
    return int.from_bytes(event[start : start + length], "little")


def test_create_lies_where_the_kernel_reads_it() -> None:
    event = create(IDENTITY)
    assert number(event, 0, 4) == 11
    assert event[4:132] == b"A controller".ljust(128, b"\0")
    assert event[132:196] == b"here".ljust(64, b"\0")
    assert event[196:260] == b"aa:bb".ljust(64, b"\0")
    assert [number(event, start, 2) for start in (260, 262)] == [3, 5]
    assert [number(event, start, 4) for start in (264, 268, 272, 276)] == [0x054C, 0x0CE6, 0x0102, 3]
    assert event[280:] == b"\x05\x01\xc0"


@pytest.mark.parametrize(
    ("event", "expected"),
    [
        (destroy(), "01000000"),
        (input_report(b"\x01\x02\x03"), "0c000000 0300 010203"),
        (get_report_reply(7, b"\x09\xaa"), "0a000000 07000000 0000 0200 09aa"),
        (get_report_reply(7, None), "0a000000 07000000 0500 0000"),
        (set_report_reply(0x01020304, accepted=True), "0e000000 04030201 0000"),
        (set_report_reply(1, accepted=False), "0e000000 01000000 0500"),
    ],
)
def test_what_is_written(event: bytes, expected: str) -> None:
    assert event == bytes.fromhex(expected)


@pytest.mark.parametrize(
    ("event", "expected"),
    [
        ("02000000 0300000000000000", Started(frozenset({FEATURE_REPORT, OUTPUT_REPORT}))),
        ("02000000 0400000000000000", Started(frozenset({INPUT_REPORT}))),
        ("03000000", Stopped()),
        ("04000000", Opened()),
        ("05000000", Closed()),
        ("09000000 2a000000 05 00", GetReport(42, 0x05, FEATURE_REPORT)),
        ("0d000000 2a000000 08 00 0200 0801", SetReport(42, 0x08, FEATURE_REPORT, b"\x08\x01")),
        ("0d000000 2a000000 02 01 0300 0201", SetReport(42, 0x02, OUTPUT_REPORT, b"\x02\x01\x00")),
        ("06000000" + "0205".ljust(8192, "0") + "0300" + "01", Output(b"\x02\x05\x00", OUTPUT_REPORT)),
        ("ff000000", None),
        ("01000000", None),
    ],
)
@pytest.mark.parametrize("filled_up", [False, True], ids=["as short as it is", "as long as the kernel makes it"])
def test_what_is_read(event: str, expected: object, filled_up: bool) -> None:
    content = bytes.fromhex(event)
    assert parse_event(content.ljust(EVENT_LENGTH, b"\0") if filled_up else content) == expected


@pytest.mark.parametrize("length", [0, 3, EVENT_LENGTH + 1])
def test_an_impossible_length_is_refused(length: int) -> None:
    with pytest.raises(ValueError, match=f"event has {length} bytes; valid: 4 to 4380"):
        parse_event(bytes(length))


@settings(derandomize=True, deadline=None)
@given(kind=st.integers(0, 20), payload=st.binary(max_size=EVENT_LENGTH - 4))
def test_any_event_is_read_or_refused(kind: int, payload: bytes) -> None:
    event = None
    with contextlib.suppress(ValueError):
        event = parse_event(struct.pack("=I", kind) + payload)
    assert not isinstance(event, Output | SetReport) or len(event.report) <= 4096


@pytest.mark.parametrize(
    ("field", "value", "complaint"),
    [
        ("name", "x" * 128, "name = .*; valid: below 128 bytes"),
        ("unique_id", "\0", "unique_id = .*; valid: below 64 bytes of UTF-8, none of them 0"),
        ("physical_place", "ä" * 32, "physical_place = .*; valid: below 64 bytes"),
        ("vendor_id", 0x10000, "vendor_id = 65536; valid: 0 to 65535"),
        ("product_id", -1, "product_id = -1; valid: 0 to 65535"),
        ("descriptor", b"", "descriptor has 0 bytes; valid: 1 to 4096"),
        ("descriptor", bytes(4097), "descriptor has 4097 bytes; valid: 1 to 4096"),
    ],
)
def test_an_identity_is_validated(field: str, value: str | int | bytes, complaint: str) -> None:
    valid = {"name": "x", "vendor_id": 1, "product_id": 1, "bus": BUS_USB, "descriptor": b"x"}
    with pytest.raises(ValueError, match=complaint):
        UhidIdentity(**(valid | {field: value}))  # type: ignore[arg-type]


def test_a_report_that_is_too_long_is_refused() -> None:
    for make in (input_report, lambda report: get_report_reply(1, report)):
        with pytest.raises(ValueError, match="report has 4097 bytes; valid: up to 4096"):
            make(bytes(4097))


# The same layout from the kernel's own header.

_PROGRAM = """
#include <stddef.h>
#include <stdio.h>
#include <linux/uhid.h>
#define AT(member) printf("%zu ", offsetof(struct uhid_event, member))
int main(void) {
    printf("%zu ", sizeof(struct uhid_event));
    AT(u.create2.phys); AT(u.create2.uniq); AT(u.create2.rd_size); AT(u.create2.bus); AT(u.create2.vendor);
    AT(u.create2.product); AT(u.create2.version); AT(u.create2.country); AT(u.create2.rd_data);
    AT(u.input2.size); AT(u.input2.data); AT(u.output.data); AT(u.output.size); AT(u.output.rtype);
    AT(u.get_report.id); AT(u.get_report.rnum); AT(u.get_report.rtype);
    AT(u.get_report_reply.id); AT(u.get_report_reply.err); AT(u.get_report_reply.size); AT(u.get_report_reply.data);
    AT(u.set_report.id); AT(u.set_report.rnum); AT(u.set_report.rtype); AT(u.set_report.size); AT(u.set_report.data);
    AT(u.set_report_reply.id); AT(u.set_report_reply.err);
    printf("%d %d %d %d %d %d", UHID_DESTROY, UHID_CREATE2, UHID_INPUT2, UHID_GET_REPORT_REPLY, UHID_SET_REPORT_REPLY,
           UHID_OUTPUT);
}
"""


@pytest.mark.processes
@pytest.mark.skipif(not HEADER.exists(), reason="no linux/uhid.h")
def test_the_layout_is_that_of_the_header(tmp_path: Path) -> None:
    (tmp_path / "layout.c").write_text(_PROGRAM)
    compiled = subprocess.run(
        ["cc", "-o", tmp_path / "layout", tmp_path / "layout.c"],  # noqa: S607
        capture_output=True,
        text=True,
        check=False,
    )
    assert compiled.returncode == 0, compiled.stderr
    said = subprocess.run([tmp_path / "layout"], capture_output=True, text=True, check=True).stdout
    expected = [EVENT_LENGTH, 132, 196, 260, 262, 264, 268, 272, 276, 280]  # test_create_lies_where...
    expected += [4, 6, 4, 4100, 4102, 4, 8, 9, 4, 8, 10, 12, 4, 8, 9, 10, 12, 4, 8]  # test_what_is_written and read
    expected += [1, 11, 12, 10, 14, 6]
    assert [int(word) for word in said.split()] == expected


# The descriptors


def report_lengths(descriptor: bytes) -> dict[tuple[str, int], int]:
    """The length in bytes, id included, of each report that a descriptor declares (HID 1.11, 6.2.2)."""
    bits: dict[tuple[str, int], int] = {}
    report_id = size = count = position = 0
    while position < len(descriptor):
        prefix = descriptor[position]
        length = (0, 1, 2, 4)[prefix & 3]
        value = int.from_bytes(descriptor[position + 1 : position + 1 + length], "little")
        match prefix & 0xFC:
            case 0x84:
                report_id = value
            case 0x74:
                size = value
            case 0x94:
                count = value
            case 0x80 | 0x90 | 0xB0 as main:
                key = ({0x80: "input", 0x90: "output", 0xB0: "feature"}[main], report_id)
                bits[key] = bits.get(key, 0) + size * count
        position += 1 + length
    assert all(total % 8 == 0 for total in bits.values())
    return {key: 1 + total // 8 for key, total in bits.items()}


def test_the_descriptors_declare_the_reports_that_are_sent() -> None:
    usb, bluetooth = report_lengths(USB_DESCRIPTOR), report_lengths(BLUETOOTH_DESCRIPTOR)
    for features in (usb, bluetooth):
        assert [features["feature", report_id] for report_id in (0x05, 0x09, 0x20)] == [41, 20, 64]
    assert (usb["input", 0x01], usb["output", 0x02]) == (64, 48)
    assert (bluetooth["input", 0x01], bluetooth["input", 0x31], bluetooth["output", 0x31]) == (10, 78, 78)
