"""Writes by a thread: the loop waits for none, the newest wins part by part, a failure is told, the end releases."""

import threading
from collections.abc import Iterator

import pytest

import operator_side.dualsense.hid.background_writes
from common.errors import DeviceError
from operator_side.dualsense.effects.official import Feedback, Off
from operator_side.dualsense.hid.background_writes import CLOSE_TIMEOUT_S, STALL_S, BackgroundWrites
from operator_side.dualsense.reports.output_report import (
    RELEASED,
    OutputReport,
    Rumble,
    build_output_report,
    parse_output_report,
)

LIMIT_S = 600.0
L2 = build_output_report(OutputReport(l2=Feedback(3, 6)))


class SlowDevice:
    """A device whose writes take until they are let through."""

    def __init__(self) -> None:
        self.written: list[OutputReport] = []
        self.released = True
        self.fails: Exception | None = None
        self.entered = threading.Semaphore(0)
        self.let = threading.Semaphore(0)
        self.done = threading.Semaphore(0)

    def read(self, now_s: float) -> bytes | None:
        del now_s
        return b"report"

    def write(self, report: bytes, now_s: float) -> None:
        del now_s
        self.entered.release()
        assert self.let.acquire(timeout=LIMIT_S)
        if self.fails is not None:
            self.done.release()
            raise self.fails
        self.written.append(parse_output_report(report))
        self.released = False
        self.done.release()

    def close(self) -> None:
        self.written.append(RELEASED)
        self.released = True


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowDevice]:
    # However late the machine lets the thread end.
    monkeypatch.setattr(operator_side.dualsense.hid.background_writes, "CLOSE_TIMEOUT_S", LIMIT_S)
    slow = SlowDevice()
    yield slow
    slow.let.release(1000)


def test_what_waits_is_merged_and_the_newest_wins(device: SlowDevice) -> None:
    writes = BackgroundWrites(device)
    writes.write(L2, 0.0)
    assert device.entered.acquire(timeout=LIMIT_S)
    # The first write hangs; neither reading nor writing waits for it.
    writes.write(build_output_report(OutputReport(l2=Feedback(0, 1), r2=Feedback(5, 2))), 0.1)
    writes.write(build_output_report(OutputReport(rumble=Rumble(left=1.0))), 0.2)
    writes.write(build_output_report(OutputReport(l2=Off())), 0.3)
    assert writes.read(0.3) == b"report"
    device.let.release(2)
    for _ in range(2):
        assert device.done.acquire(timeout=LIMIT_S)
    assert device.written == [
        OutputReport(l2=Feedback(3, 6)),
        OutputReport(l2=Off(), r2=Feedback(5, 2), rumble=Rumble(left=1.0)),
    ]
    assert not writes.released
    writes.close()
    assert writes.released


def test_one_that_does_not_return_stalls_and_nothing_counts_as_released(device: SlowDevice) -> None:
    writes = BackgroundWrites(device)
    assert writes.released
    assert not writes.stalls(100.0)
    writes.write(L2, 0.0)
    assert not writes.released
    assert device.entered.acquire(timeout=LIMIT_S)
    assert not writes.released
    assert not writes.stalls(STALL_S)
    assert writes.stalls(2 * STALL_S)
    device.let.release()
    assert device.done.acquire(timeout=LIMIT_S)
    device.released = True  # as after an effect of none
    writes.write(L2, 0.1)
    assert device.entered.acquire(timeout=LIMIT_S)
    assert not writes.stalls(0.1 + STALL_S / 2)
    device.let.release()
    writes.close()
    assert writes.released
    assert not writes.stalls(100.0)


def test_a_close_drops_what_waits_and_releases(device: SlowDevice) -> None:
    writes = BackgroundWrites(device)
    writes.write(L2, 0.0)
    assert device.entered.acquire(timeout=LIMIT_S)
    writes.write(build_output_report(OutputReport(r2=Feedback(5, 2))), 0.1)
    device.let.release()
    assert device.done.acquire(timeout=LIMIT_S)
    device.let.release(10)
    writes.close()
    assert device.written[-1] == RELEASED
    assert writes.released


def test_a_write_that_never_returns_keeps_nobody_and_is_not_called_released(
    device: SlowDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(operator_side.dualsense.hid.background_writes, "CLOSE_TIMEOUT_S", CLOSE_TIMEOUT_S)
    writes = BackgroundWrites(device)
    writes.write(L2, 0.0)
    assert device.entered.acquire(timeout=LIMIT_S)
    writes.close()
    assert not writes.released
    assert device.written == []


@pytest.mark.parametrize("kind", [DeviceError, RuntimeError])
def test_a_failed_write_is_told_by_the_next_call(device: SlowDevice, kind: type[Exception]) -> None:
    device.fails = kind("gone")
    writes = BackgroundWrites(device)
    device.let.release()
    writes.write(L2, 0.0)
    assert device.done.acquire(timeout=LIMIT_S)
    writes._thread.join(LIMIT_S)
    with pytest.raises(kind, match="gone"):
        writes.read(0.1)
    with pytest.raises(kind, match="gone"):
        writes.write(L2, 0.1)
    writes.close()


def test_what_cannot_be_read_is_refused_at_once(device: SlowDevice) -> None:
    writes = BackgroundWrites(device)
    with pytest.raises(ValueError, match="report"):
        writes.write(b"\x02", 0.0)
    writes.close()
    assert device.written == [RELEASED]
