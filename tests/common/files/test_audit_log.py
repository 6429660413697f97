import json
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from common.files.audit_log import KEPT, AuditLog


def events(path: Path) -> list[dict[str, object]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_each_run_adds_its_events_with_time_and_names(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    for run in range(2):
        log = AuditLog(path, lambda: 1.7e9)
        log.note("armed", who="anna", where="10.0.0.3:5123", run=run)
        log.close()
    assert events(path) == [
        {"time_s": 1.7e9, "event": "armed", "who": "anna", "where": "10.0.0.3:5123", "run": run} for run in range(2)
    ]
    assert path.stat().st_mode & 0o777 == 0o600


def test_no_text_from_outside_makes_a_line_of_its_own(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "audit.jsonl", lambda: 0.0)
    log.note("refused", who='a"}\n{"event": "armed", "who": "\x1b[2J')
    log.close()
    assert len(events(tmp_path / "audit.jsonl")) == 1
    assert "\x1b" not in (tmp_path / "audit.jsonl").read_text()


def test_files_are_put_aside_and_the_oldest_go(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    log = AuditLog(path, lambda: 0.0, largest_bytes=100)
    for number in range(20):
        log.note("armed", number=number, filling="x" * 30)
    log.close()
    files = sorted(tmp_path.iterdir())
    assert [file.name for file in files] == ["audit.jsonl", *(f"audit.jsonl.{number}" for number in range(1, KEPT + 1))]
    assert all(file.stat().st_size <= 100 for file in files)
    assert events(path)[-1]["number"] == 19
    assert log.failed == 0


def test_a_link_is_refused_and_a_disk_that_refuses_is_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    for path in (tmp_path / "link", tmp_path / "missing" / "audit.jsonl"):
        with pytest.raises(ConfigurationError, match=r"--audit .*valid: "):
            AuditLog(path, lambda: 0.0)

    def full(*_: object) -> None:
        raise OSError

    log = AuditLog(tmp_path / "audit.jsonl", lambda: 0.0)
    monkeypatch.setattr("common.files.audit_log.os.write", full)
    log.note("armed")
    log.close()
    assert log.failed == 1
