import threading
from collections.abc import Iterator

import pytest

import operator_side.controller.background_writes
from common.errors import DeviceError
from operator_side.controller.background_writes import CLOSE_TIMEOUT_S, STALL_S, BackgroundWrites
from operator_side.controller.feel import FREE_TRIGGER, RELEASED, Feel, Rumble
from operator_side.controller.state import ControllerState
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.messages import feedback

STIFF = Feel(r2=feedback(3, 6))


class SlowDevice:
    """Device whose writes block until the test releases them."""

    def __init__(self) -> None:
        self.written: list[Feel] = []
        self.released = True
        self.fails: Exception | None = None
        self.entered = threading.Semaphore(0)
        self.let = threading.Semaphore(0)
        self.done = threading.Semaphore(0)

    def read(self, now_s: float) -> ControllerState | None:
        del now_s
        return ControllerState()

    def write(self, output: Feel, now_s: float) -> None:
        del now_s
        self.entered.release()
        assert self.let.acquire(timeout=LIMIT_S)
        if self.fails is not None:
            self.done.release()
            raise self.fails
        self.written.append(output)
        self.released = False
        self.done.release()

    def close(self) -> None:
        self.written.append(RELEASED)
        self.released = True


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> Iterator[SlowDevice]:
    # Wait, as a busy machine may let the thread end late.
    monkeypatch.setattr(operator_side.controller.background_writes, "CLOSE_TIMEOUT_S", LIMIT_S)
    made = SlowDevice()
    yield made
    made.let.release(1000)


def test_what_waits_is_merged_and_the_newest_wins(slow: SlowDevice) -> None:
    writes = BackgroundWrites(slow)
    assert writes.released
    assert not writes.stalls(100.0)
    writes.write(STIFF, 0.0)
    assert slow.entered.acquire(timeout=LIMIT_S)
    assert (writes.released, writes.stalls(STALL_S), writes.stalls(2 * STALL_S)) == (False, False, True)
    # The first write hangs; neither reading nor writing waits for it.
    writes.write(Feel(l2=feedback(0, 1), r2=feedback(5, 2)), 0.1)
    writes.write(Feel(rumble=Rumble(left=1.0)), 0.2)
    writes.write(Feel(l2=FREE_TRIGGER), 0.3)
    assert writes.read(0.3) == ControllerState()
    slow.let.release(2)
    for _ in range(2):
        assert slow.done.acquire(timeout=LIMIT_S)
    assert slow.written == [STIFF, Feel(l2=FREE_TRIGGER, r2=feedback(5, 2), rumble=Rumble(left=1.0))]
    assert not writes.released
    writes.close()
    assert writes.released
    assert not writes.stalls(100.0)


def test_a_close_drops_what_waits_and_releases(slow: SlowDevice) -> None:
    writes = BackgroundWrites(slow)
    writes.write(STIFF, 0.0)
    assert slow.entered.acquire(timeout=LIMIT_S)
    writes.write(Feel(r2=feedback(5, 2)), 0.1)
    slow.let.release()
    assert slow.done.acquire(timeout=LIMIT_S)
    slow.let.release(10)
    writes.close()
    assert slow.written[-1] == RELEASED
    assert writes.released


def test_a_write_that_never_returns_keeps_nobody_and_is_not_called_released(
    slow: SlowDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(operator_side.controller.background_writes, "CLOSE_TIMEOUT_S", CLOSE_TIMEOUT_S)
    writes = BackgroundWrites(slow)
    writes.write(STIFF, 0.0)
    assert slow.entered.acquire(timeout=LIMIT_S)
    writes.close()
    assert not writes.released
    assert slow.written == []


@pytest.mark.parametrize("kind", [DeviceError, RuntimeError])
def test_a_failed_write_is_told_by_the_next_call(slow: SlowDevice, kind: type[Exception]) -> None:
    slow.fails = kind("gone")
    writes = BackgroundWrites(slow)
    slow.let.release()
    writes.write(STIFF, 0.0)
    assert slow.done.acquire(timeout=LIMIT_S)
    writes._thread.join(LIMIT_S)
    with pytest.raises(kind, match="gone"):
        writes.read(0.1)
    with pytest.raises(kind, match="gone"):
        writes.write(STIFF, 0.1)
    writes.close()
