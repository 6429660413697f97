import gc
from collections.abc import Iterator

import pytest

from common.clock import VirtualClock
from common.realtime import garbage
from common.realtime.garbage import IdleCollection


@pytest.fixture(autouse=True)
def collector() -> Iterator[None]:
    yield
    gc.enable()
    gc.unfreeze()


def test_nothing_is_collected_by_itself_while_it_is_open() -> None:
    with IdleCollection(VirtualClock()):
        assert not gc.isenabled()
        assert gc.get_freeze_count() > 0
    assert gc.isenabled()
    assert gc.get_freeze_count() == 0


def test_it_collects_at_rest_every_ten_seconds_and_never_in_motion() -> None:
    with IdleCollection(VirtualClock()) as collection:
        for now_s in (1.0, 9.0, 30.0):
            collection.idle(now_s, resting=False)
        assert collection.summary() == {"collections": 0, "max_ms": None}
        for now_s in (30.1, 31.0, 39.0, 40.2):
            collection.idle(now_s, resting=True)
        assert collection.summary()["collections"] == 2


def test_much_garbage_is_collected_in_motion_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(garbage, "_PRESSING_OBJECTS", 1000)
    with IdleCollection(VirtualClock()) as collection:
        kept = []
        for _ in range(2000):
            cycle: list[object] = []
            cycle.append(cycle)
            kept.append(cycle)
        collection.idle(0.0, resting=False)
        assert collection.summary()["collections"] == 1
        collection.idle(0.0, resting=False)
        assert collection.summary()["collections"] == 1
