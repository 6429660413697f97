"""The file /dev/uhid and the loop on it, with another file and a kernel in virtual time in their places."""

import os
from collections import deque
from pathlib import Path

import pytest

from common.clock import VirtualClock
from common.errors import ConfigurationError, DeviceError
from operator_side.dualsense.uhid.controller import UhidController, identity
from operator_side.dualsense.uhid.file import UhidFile, offer
from operator_side.dualsense.uhid.protocol import get_report_reply, input_report
from tests.helpers.fake_kernel import START, FakeKernel, PlainController, get_report, output, said

CREATE2, DESTROY, INPUT2 = 11, 1, 12


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
    assert [now_s for now_s, _ in kernel.heard_of(10)] == pytest.approx(times)
    assert asked == pytest.approx([0.0, 0.004, 0.008, 0.012, 0.016, 0.02])


def test_what_the_kernel_sends_reaches_the_controller() -> None:
    kernel = FakeKernel(VirtualClock(), deque([(0.001, output(b"\x02\x05")), (0.001, output(b"\x02\x06"))]))
    plain = PlainController()
    lived(kernel, UhidController(plain, identity()), until_s=0.008)
    assert plain.written == [b"\x02\x05", b"\x02\x06"]


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


def test_without_the_file_one_line_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError) as caught:
        UhidFile(tmp_path / "uhid")
    assert "sudo modprobe uhid" in str(caught.value)
    assert "--device=/dev/uhid" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("number", "expected"), [(13, "no permission.*setfacl"), (1, "no permission.*setfacl"), (19, "cannot be opened")]
)
def test_a_refusal_says_what_to_do(monkeypatch: pytest.MonkeyPatch, number: int, expected: str) -> None:
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
