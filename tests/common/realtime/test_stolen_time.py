from pathlib import Path

import pytest

from common.realtime import stolen_time as module
from common.realtime.stolen_time import StolenTime, read_stolen_time


def test_the_counts_are_read_in_their_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    waited, processors = tmp_path / "schedstat", tmp_path / "stat"
    waited.write_text("5000000000 1500000000 77\n")
    # user nice system idle iowait irq softirq steal guest guest_nice: a guest's time is in user's, too
    processors.write_text("cpu  10 20 30 40 50 60 70 20 999 999\ncpu0 1 1 1 1 1 1 1 1 1 1\n")
    monkeypatch.setattr(module, "_WAITED", waited)
    monkeypatch.setattr(module, "_PROCESSORS", processors)
    assert read_stolen_time() == StolenTime(waited_s=1.5, stolen=20.0, whole=300.0)


@pytest.mark.parametrize("text", ["", "nonsense\n", "cpu 1 2\n"])
def test_a_system_that_does_not_count_is_unknown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    (tmp_path / "file").write_text(text)
    for name in ("_WAITED", "_PROCESSORS"):
        monkeypatch.setattr(module, name, tmp_path / "file")
    assert read_stolen_time() in (StolenTime(None, None, None), StolenTime(1e-9, None, None))
    for name in ("_WAITED", "_PROCESSORS"):
        monkeypatch.setattr(module, name, tmp_path / "none")
    assert read_stolen_time() == StolenTime(None, None, None)
    assert StolenTime(1.0, 2.0, 3.0).shares_since(StolenTime(None, None, None), 1.0) == (None, None)


def test_shares_are_of_what_passed() -> None:
    assert StolenTime(3.0, 15.0, 400.0).shares_since(StolenTime(2.0, 5.0, 200.0), 4.0) == (0.25, 0.05)
