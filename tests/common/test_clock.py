import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from common.clock import VirtualClock, clock_domain


@pytest.fixture
def fresh_domain() -> Iterator[None]:
    clock_domain.cache_clear()
    yield
    clock_domain.cache_clear()


@pytest.mark.parametrize("past_s", [0.999, -1.0, -math.inf, math.nan])
def test_a_virtual_clock_never_runs_backwards(past_s: float) -> None:
    clock = VirtualClock(1.0)
    with pytest.raises(ValueError, match=f"now_s = {past_s}"):
        clock.advance_to(past_s)
    assert clock.now() == 1.0
    clock.advance_to(2.0)
    with pytest.raises(ValueError, match="now_s"):
        clock.advance_to(1.5)


@pytest.mark.usefixtures("fresh_domain")
@pytest.mark.parametrize("missing", ["read_text", "readlink"])
def test_a_clock_that_cannot_be_named_is_shared_with_nobody(monkeypatch: pytest.MonkeyPatch, missing: str) -> None:
    def fail(*_: object, **__: object) -> str:
        raise FileNotFoundError(2, "no such file")

    monkeypatch.setattr(Path, missing, fail)
    assert clock_domain() == ""


@pytest.mark.usefixtures("fresh_domain")
def test_another_boot_or_time_namespace_is_another_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    def domain(boot: str, namespace: str) -> str:
        monkeypatch.setattr(Path, "read_text", lambda *_, **__: f"{boot}\n")
        monkeypatch.setattr(Path, "readlink", lambda *_: Path(namespace))
        clock_domain.cache_clear()
        return clock_domain()

    names = [domain(boot, space) for boot in ("boot1", "boot2") for space in ("time:[1]", "time:[2]")]
    assert len(set(names)) == 4
    assert all("\n" not in name for name in names)
