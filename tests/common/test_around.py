"""A map of ways is refused for what cannot be, and tells what differs."""

import msgspec
import pytest

from common.protocol.around import PROBES, Around

FREE = (0.3,) * PROBES
TOLD = Around(0.8, FREE, FREE, FREE, FREE)


@pytest.mark.parametrize("full_s", [0.0, -1.0, float("nan"), float("inf"), 101.0])
def test_a_time_that_cannot_be_is_named(full_s: float) -> None:
    with pytest.raises(ValueError, match="full_s"):
        msgspec.structs.replace(TOLD, full_s=full_s)


@pytest.mark.parametrize("name", ["l2_m", "l2_slow_m", "r2_m", "r2_slow_m"])
@pytest.mark.parametrize("ways", [FREE[1:], (*FREE, 0.3), (-0.1, *FREE[1:]), (float("nan"), *FREE[1:])])
def test_ways_that_cannot_be_are_named(name: str, ways: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match=name):
        msgspec.structs.replace(TOLD, **{name: ways})


def test_it_differs_by_a_way_or_by_its_time() -> None:
    nearer = msgspec.structs.replace(TOLD, r2_slow_m=(*FREE[:-1], 0.297))
    assert not TOLD.differs(TOLD, 0.0)
    assert TOLD.differs(nearer, 0.002)
    assert not TOLD.differs(nearer, 0.004)
    assert TOLD.differs(msgspec.structs.replace(TOLD, full_s=0.81), 1.0)
