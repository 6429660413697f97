"""/dev/uhid: its protocol down to the byte, the controller that the kernel is offered, the file and the loop on it."""

import contextlib
import os
import struct
from collections import deque
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.clock import VirtualClock
from common.errors import ConfigurationError, DeviceError
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.report_descriptors import BLUETOOTH_DESCRIPTOR, USB_DESCRIPTOR
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.uhid.controller import UhidController, UhidCounts, identity
from operator_side.dualsense.uhid.file import UhidFile, offer
from operator_side.dualsense.uhid.protocol import (
    BUS_BLUETOOTH,
    EVENT_LENGTH,
    FEATURE_REPORT,
    OUTPUT_REPORT,
    GetReport,
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
from tests.helpers.fake_kernel import (
    OPEN,
    OUT,
    START,
    STOP,
    FakeKernel,
    PlainController,
    get_report,
    output,
    said,
    set_report,
)

CREATE2, DESTROY, INPUT2, GET_REPORT_REPLY = 11, 1, 12, 10


# The protocol


def test_create_lies_where_the_kernel_reads_it() -> None:
    event = create(
        UhidIdentity(
            name="A controller",
            vendor_id=0x054C,
            product_id=0x0CE6,
            bus=BUS_BLUETOOTH,
            descriptor=b"\x05\x01\xc0",
            unique_id="aa:bb",
            physical_place="here",
        )
    )
    assert event[4:132] == b"A controller".ljust(128, b"\0")
    assert event[132:196] == b"here".ljust(64, b"\0")
    assert event[196:260] == b"aa:bb".ljust(64, b"\0")
    assert struct.unpack_from("=I", event) == (CREATE2,)
    assert struct.unpack_from("=HHIIII", event, 260) == (3, 5, 0x054C, 0x0CE6, 0x0100, 0)
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
        ("02000000 0300000000000000", Started()),
        ("03000000", Stopped()),
        ("04000000", None),
        ("05000000", None),
        ("09000000 2a000000 05 00", GetReport(42, 0x05, FEATURE_REPORT)),
        ("0d000000 2a000000 08 00 0200 0801", SetReport(42, FEATURE_REPORT, b"\x08\x01")),
        ("0d000000 2a000000 02 01 0300 0201", SetReport(42, OUTPUT_REPORT, b"\x02\x01\x00")),
        ("06000000" + "0205".ljust(8192, "0") + "0300" + "01", Output(b"\x02\x05\x00", OUTPUT_REPORT)),
        ("ff000000", None),
        ("01000000", None),
    ],
)
@pytest.mark.parametrize("filled_up", [False, True], ids=["as short as it is", "as long as the kernel makes it"])
def test_what_is_read(event: str, expected: object, filled_up: bool) -> None:
    content = bytes.fromhex(event)
    assert parse_event(content.ljust(EVENT_LENGTH, b"\0") if filled_up else content) == expected


@settings(derandomize=True, deadline=None)
@given(kind=st.integers(0, 20), payload=st.binary(max_size=EVENT_LENGTH - 4))
def test_any_event_is_read_or_refused(kind: int, payload: bytes) -> None:
    event = None
    with contextlib.suppress(ValueError):
        event = parse_event(struct.pack("=I", kind) + payload)
    assert not isinstance(event, Output | SetReport) or len(event.report) <= 4096


def test_refusals() -> None:
    for length in (0, 3, EVENT_LENGTH + 1):
        with pytest.raises(ValueError, match=f"event has {length} bytes; valid: 4 to 4380"):
            parse_event(bytes(length))
    for make in (input_report, lambda report: get_report_reply(1, report)):
        with pytest.raises(ValueError, match="report has 4097 bytes; valid: up to 4096"):
            make(bytes(4097))
    with pytest.raises(ValueError, match=r"unique_id = 'x+'; valid: 0 to 63 characters"):
        identity(unique_id="x" * 64)
    with pytest.raises(ValueError, match="vendor_id = 65536; valid: 0 to 65535"):
        UhidIdentity(name="x", vendor_id=0x10000, product_id=1, bus=3, descriptor=b"x")


# The controller that is offered


@pytest.mark.parametrize(("model", "product_id"), [(Model.DUALSENSE, 0x0CE6), (Model.EDGE, 0x0DF2)])
@pytest.mark.parametrize("transport", Transport)
def test_identities(transport: Transport, model: Model, product_id: int) -> None:
    told, wireless = identity(transport, model, unique_id="aa:bb"), transport is Transport.BLUETOOTH
    assert (told.bus, told.vendor_id, told.product_id) == (5 if wireless else 3, 0x054C, product_id)
    name = "DualSense Edge Wireless Controller" if model is Model.EDGE else "DualSense Wireless Controller"
    assert (told.name, told.unique_id) == (name if wireless else f"Sony Interactive Entertainment {name}", "aa:bb")
    assert told.descriptor == (BLUETOOTH_DESCRIPTOR if wireless else USB_DESCRIPTOR)


@pytest.mark.parametrize(
    ("asked", "answer", "counts"),
    [
        (get_report(42, 5), get_report_reply(42, b"\x05\x01\x02"), UhidCounts(features=1)),
        (get_report(43, 6), get_report_reply(43, None), UhidCounts(refused=1)),
        (get_report(44, 5, OUT), get_report_reply(44, None), UhidCounts(refused=1)),
        (output(b"\x02\x07"), None, UhidCounts(outputs=1)),
        (output(b"\x03\x07"), None, UhidCounts(refused=1)),
        (set_report(9, b"\x02\x07"), set_report_reply(9, accepted=True), UhidCounts(outputs=1)),
        (set_report(10, b"\x03\x07"), set_report_reply(10, accepted=False), UhidCounts(refused=1)),
        (set_report(11, b"\x02\x08", kind=0), set_report_reply(11, accepted=False), UhidCounts(refused=1)),
        (said(OPEN), None, UhidCounts()),
        (said(99), None, UhidCounts()),
    ],
)
def test_the_kernel_is_answered_as_the_controller_answers(
    asked: bytes, answer: bytes | None, counts: UhidCounts
) -> None:
    plain = PlainController()
    offered = UhidController(plain, identity())
    assert (offered.handle(asked, 0.0), offered.counts) == (answer, counts)
    assert plain.written == [b"\x02\x07"] * counts.outputs


def test_input_reports_go_out_while_a_driver_has_it() -> None:
    offered = UhidController(PlainController(), identity())
    offered.plug_in()
    assert offered.next_input(0.0) is None
    offered.handle(said(START), 0.0)
    # What was made before is lost, as on a cable that nobody polls.
    assert offered.next_input(0.0) == input_report(b"\x01\x02")
    offered.handle(said(STOP), 0.0)
    assert offered.next_input(0.0) is None
    assert offered.counts.inputs == 1


# The loop


def lived(kernel: FakeKernel, controller: UhidController, until_s: float) -> list[float]:
    """Offer `controller` until then; when it was asked whether to go on."""
    asked: list[float] = []

    def going(now_s: float) -> bool:
        asked.append(now_s)
        return now_s < until_s

    offer(kernel, controller, kernel.clock, 0.004, going)
    return asked


def test_a_life_from_plug_to_unplug() -> None:
    kernel = FakeKernel(VirtualClock(100.0), deque([(100.0, get_report(1, 5)), (100.001, said(START))]))
    lived(kernel, UhidController(PlainController(), identity()), until_s=100.02)
    kinds = [event[0] for _, event in kernel.heard]
    assert (kinds[0], kinds[-1]) == (CREATE2, DESTROY)
    assert kernel.heard[1] == (100.0, get_report_reply(1, b"\x05\x01\x02"))
    assert [now_s for now_s, _ in kernel.heard_of(INPUT2)] == pytest.approx([100.004, 100.008, 100.012, 100.016])
    assert kernel.heard_of(INPUT2)[0][1] == input_report(b"\x01\x02")


def test_questions_are_answered_as_they_come_and_reports_stay_in_time() -> None:
    times = [0.0013, 0.0021, 0.0049]
    events = [(0.0, said(START)), *((now_s, get_report(n, 5)) for n, now_s in enumerate(times))]
    kernel = FakeKernel(VirtualClock(), deque(events))
    asked = lived(kernel, UhidController(PlainController(), identity()), until_s=0.02)
    assert [now_s for now_s, _ in kernel.heard_of(GET_REPORT_REPLY)] == pytest.approx(times)
    assert asked == pytest.approx([0.0, 0.004, 0.008, 0.012, 0.016, 0.02])


def test_a_kernel_that_lets_it_go_ends_its_life_with_an_error() -> None:
    kernel = FakeKernel(VirtualClock(), deque([(0.0, said(START))]), refuses_from_s=0.01)
    with pytest.raises(DeviceError, match="let the controller go"):
        lived(kernel, UhidController(PlainController(), identity()), until_s=1.0)
    assert kernel.clock.now() == pytest.approx(0.012)


def test_it_is_unplugged_when_the_loop_fails() -> None:
    kernel = FakeKernel(VirtualClock())

    def fails(now_s: float) -> bool:
        raise KeyError(now_s)

    with pytest.raises(KeyError):
        offer(kernel, UhidController(PlainController(), identity()), kernel.clock, 0.004, fails)
    assert [event[0] for _, event in kernel.heard] == [CREATE2, DESTROY]


# The file


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    """A file that gives back what was written to it."""
    path = tmp_path / "uhid"
    os.mkfifo(path)
    return path


def test_the_file_reads_and_writes_without_waiting(pipe: Path) -> None:
    with UhidFile(pipe) as file:
        assert file.read() is None
        assert not file.wait(0.0)
        file.write(b"\x01\x00\x00\x00")
        assert file.wait(-1.0)
        assert file.read() == b"\x01\x00\x00\x00"
    file.close()
    for use in (file.read, lambda: file.wait(0.0), lambda: file.write(b"x")):
        with pytest.raises(DeviceError, match="closed"):
            use()


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (2, "sudo modprobe uhid.*--device=/dev/uhid"),
        (13, "no permission.*setfacl"),
        (1, "no permission.*setfacl"),
        (19, "cannot be opened"),
    ],
)
def test_a_refusal_says_in_one_line_what_to_do(monkeypatch: pytest.MonkeyPatch, number: int, expected: str) -> None:
    def refuse(*_: object) -> int:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(ConfigurationError, match=expected) as caught:
        UhidFile()
    assert "\n" not in str(caught.value)


def test_a_kernel_that_refuses_a_write_is_quoted(pipe: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise OSError(22, os.strerror(22))

    with UhidFile(pipe) as file:
        monkeypatch.setattr(os, "write", refuse)
        with pytest.raises(DeviceError, match=r"has let the controller go \(Invalid argument\)"):
            file.write(b"x")
