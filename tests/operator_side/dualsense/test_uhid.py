import os
import struct
from collections import deque
from pathlib import Path

import pytest

from common.clock import VirtualClock
from common.errors import ConfigurationError, DeviceError
from operator_side.dualsense.reports.models import Model
from operator_side.dualsense.reports.report_descriptors import BLUETOOTH_DESCRIPTOR, USB_DESCRIPTOR
from operator_side.dualsense.reports.transport import Transport
from operator_side.dualsense.uhid.controller import EVENT_LENGTH, UhidController, UhidCounts, UhidIdentity
from operator_side.dualsense.uhid.file import UhidFile, offer
from tests.helpers.fake_kernel import START, FakeKernel, PlainController, get_report, said

CREATE2, DESTROY, INPUT2, GET_REPORT_REPLY = 11, 1, 12, 10
ANSWER = bytes.fromhex("0a000000 01000000 0000 0300 050102")


@pytest.mark.parametrize(("model", "product_id"), [(Model.DUALSENSE, 0x0CE6), (Model.EDGE, 0x0DF2)])
@pytest.mark.parametrize("transport", Transport)
def test_create_lies_where_the_kernel_reads_it(transport: Transport, model: Model, product_id: int) -> None:
    event = UhidIdentity(transport, model, "aa:bb").create()
    wireless = transport is Transport.BLUETOOTH
    name = b"DualSense Edge Wireless Controller" if model is Model.EDGE else b"DualSense Wireless Controller"
    descriptor = BLUETOOTH_DESCRIPTOR if wireless else USB_DESCRIPTOR
    assert struct.unpack_from("=I", event) == (CREATE2,)
    assert event[4:132] == (name if wireless else b"Sony Interactive Entertainment " + name).ljust(128, b"\0")
    assert event[132:196].rstrip(b"\0") == b"feelahead/virtual-dualsense"
    assert event[196:260] == b"aa:bb".ljust(64, b"\0")
    numbers = (len(descriptor), 5 if wireless else 3, 0x054C, product_id, 0x0100, 0)
    assert struct.unpack_from("=HHIIII", event, 260) == numbers
    assert event[280:] == descriptor


@pytest.mark.parametrize("filled_up", [False, True], ids=["as short as it is", "as long as the kernel makes it"])
@pytest.mark.parametrize(
    ("event", "answer", "counts", "written"),
    [
        ("03000000", None, UhidCounts(), b""),
        ("04000000", None, UhidCounts(), b""),
        ("01000000", None, UhidCounts(), b""),
        ("ff000000", None, UhidCounts(), b""),
        ("09000000 01000000 05 00", ANSWER.hex(), UhidCounts(features=1), b""),
        ("09000000 2a000000 06 00", "0a000000 2a000000 0500 0000", UhidCounts(refused=1), b""),
        ("09000000 2a000000 05 01", "0a000000 2a000000 0500 0000", UhidCounts(refused=1), b""),
        ("0d000000 04030201 02 01 0300 0201", "0e000000 04030201 0000", UhidCounts(outputs=1), b"\x02\x01\x00"),
        ("0d000000 01000000 03 01 0200 0301", "0e000000 01000000 0500", UhidCounts(refused=1), b""),
        ("0d000000 01000000 02 00 0200 0208", "0e000000 01000000 0500", UhidCounts(refused=1), b""),
        ("06000000" + "0205".ljust(8192, "0") + "0300" + "01", None, UhidCounts(outputs=1), b"\x02\x05\x00"),
        ("06000000" + "0305".ljust(8192, "0") + "0300" + "01", None, UhidCounts(refused=1), b""),
    ],
)
def test_the_kernel_is_answered_as_the_controller_answers(
    event: str, answer: str | None, counts: UhidCounts, written: bytes, filled_up: bool
) -> None:
    plain, content = PlainController(), bytes.fromhex(event)
    offered = UhidController(plain, UhidIdentity())
    said_back = offered.handle(content.ljust(EVENT_LENGTH, b"\0") if filled_up else content, 0.0)
    assert (said_back, offered.counts) == (None if answer is None else bytes.fromhex(answer), counts)
    assert b"".join(plain.written) == written


def test_refusals() -> None:
    for length in (0, 3, EVENT_LENGTH + 1):
        with pytest.raises(ValueError, match=f"event has {length} bytes; valid: 4 to 4380"):
            UhidController(PlainController(), UhidIdentity()).handle(bytes(length), 0.0)
    with pytest.raises(ValueError, match="report has 4097 bytes; valid: up to 4096"):
        UhidController(PlainController(), UhidIdentity()).handle(said(13, struct.pack("=IBBH", 1, 2, 1, 4097)), 0.0)
    with pytest.raises(ValueError, match=r"unique_id = 'x+'; valid: 0 to 63 characters"):
        UhidIdentity(unique_id="x" * 64)


def lived(kernel: FakeKernel, until_s: float) -> list[float]:
    """Offer a controller until `until_s`; return the times at which the loop asked whether to continue."""
    asked: list[float] = []

    def going(now_s: float) -> bool:
        asked.append(now_s)
        return now_s < until_s

    offer(kernel, UhidController(PlainController(), UhidIdentity()), kernel.clock, 0.004, going)
    return asked


def test_a_life_from_plug_to_unplug() -> None:
    """Reports made before a driver uses the device are lost, as on a cable that nobody polls."""
    kernel = FakeKernel(VirtualClock(100.0), deque([(100.0, get_report(1, 5)), (100.001, said(START))]))
    lived(kernel, until_s=100.02)
    kinds = [event[0] for _, event in kernel.heard]
    assert (kinds[0], kernel.heard[-1][1]) == (CREATE2, bytes.fromhex("01000000"))
    assert kernel.heard[1] == (100.0, ANSWER)
    assert [now_s for now_s, _ in kernel.heard_of(INPUT2)] == pytest.approx([100.004, 100.008, 100.012, 100.016])
    assert kernel.heard_of(INPUT2)[0][1] == bytes.fromhex("0c000000 0200 0102")


def test_questions_are_answered_as_they_come_and_reports_go_out_in_time_while_a_driver_has_it() -> None:
    times = [0.0013, 0.0021, 0.0049]
    events = [(0.0, said(START)), *((now_s, get_report(n, 5)) for n, now_s in enumerate(times)), (0.009, said(3))]
    kernel = FakeKernel(VirtualClock(), deque(events))
    asked = lived(kernel, until_s=0.02)
    assert [now_s for now_s, _ in kernel.heard_of(GET_REPORT_REPLY)] == pytest.approx(times)
    assert asked == pytest.approx([0.0, 0.004, 0.008, 0.012, 0.016, 0.02])
    assert [now_s for now_s, _ in kernel.heard_of(INPUT2)] == pytest.approx([0.0, 0.004, 0.008])


def test_a_kernel_that_lets_it_go_ends_its_life_with_an_error() -> None:
    kernel = FakeKernel(VirtualClock(), deque([(0.0, said(START))]), refuses_from_s=0.01)
    with pytest.raises(DeviceError, match="released the controller"):
        lived(kernel, until_s=1.0)
    assert kernel.clock.now() == pytest.approx(0.012)


def test_it_is_unplugged_when_the_loop_fails() -> None:
    kernel = FakeKernel(VirtualClock())

    def fails(now_s: float) -> bool:
        raise KeyError(now_s)

    with pytest.raises(KeyError):
        offer(kernel, UhidController(PlainController(), UhidIdentity()), kernel.clock, 0.004, fails)
    assert [event[0] for _, event in kernel.heard] == [CREATE2, DESTROY]


def test_the_file_reads_and_writes_without_waiting_and_quotes_a_refusal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "uhid"
    os.mkfifo(path)  # A FIFO returns what was written to it.
    with UhidFile(path) as file:
        assert file.read() is None
        assert not file.wait(0.0)
        file.write(b"\x01\x00\x00\x00")
        assert file.wait(-1.0)
        assert file.read() == b"\x01\x00\x00\x00"
        monkeypatch.setattr(os, "write", refusing(22))
        with pytest.raises(DeviceError, match=r"has released the controller \(Invalid argument\)"):
            file.write(b"x")
    for use in (file.read, lambda: file.wait(0.0), lambda: file.write(b"x")):
        with pytest.raises(DeviceError, match="closed"):
            use()


@pytest.mark.parametrize(
    ("number", "expected"),
    [(2, "sudo modprobe uhid.*--device=/dev/uhid"), (13, "no permission.*setfacl"), (19, "cannot be opened")],
)
def test_a_refusal_says_in_one_line_what_to_do(monkeypatch: pytest.MonkeyPatch, number: int, expected: str) -> None:
    monkeypatch.setattr(os, "open", refusing(number))
    with pytest.raises(ConfigurationError, match=expected) as caught:
        UhidFile()
    assert "\n" not in str(caught.value)


def refusing(number: int) -> object:
    def refuse(*_: object) -> int:
        raise OSError(number, os.strerror(number))

    return refuse
