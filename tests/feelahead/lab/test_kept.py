import errno
import fcntl
import resource
from pathlib import Path

import pytest

from common.errors import ConfigurationError, FeelaheadError
from feelahead.lab.approaches.kept import Kept


def test_what_was_done_is_kept_and_a_torn_line_is_done_again(tmp_path: Path) -> None:
    path = tmp_path / "kept.jsonl"
    kept = Kept(path, {"plan": {}, "seed": 0})
    kept.keep("one", [{"kind": "cell", "law": "swept"}])
    kept.keep("two", [])
    kept.keep("three", [{"kind": "failed", "piece": "three", "why": "not armed"}])
    kept.close()
    path.write_text(path.read_text()[:-10])
    again = Kept(path, {"plan": {}, "seed": 0})
    assert again.done == {"one": [{"kind": "cell", "law": "swept"}]}
    again.keep("two", [{"kind": "check"}])
    again.close()
    last = Kept(path, {"plan": {}, "seed": 0})
    assert last.done == {"one": [{"kind": "cell", "law": "swept"}], "two": [{"kind": "check"}]}
    last.close()
    with pytest.raises(ConfigurationError, match="other settings"):
        Kept(path, {"plan": {}, "seed": 1})
    held = Kept(path, {"plan": {}, "seed": 0})
    with pytest.raises(ConfigurationError, match="another run writes to it"):
        Kept(path, {"plan": {}, "seed": 0})
    held.close()
    path.write_bytes(bytes(range(256)))
    with pytest.raises(ConfigurationError, match="no run of this benchmark"):
        Kept(path, {"plan": {}, "seed": 0})
    path.write_text("nothing of ours\n")
    with pytest.raises(ConfigurationError, match="no run of this benchmark"):
        Kept(path, {"plan": {}, "seed": 0})


def test_what_never_ends_is_not_read() -> None:
    for device in ("/dev/zero", "/dev/full"):
        with pytest.raises(ConfigurationError, match="no regular file"):
            Kept(Path(device), {})


def test_a_line_without_records_is_done_again(tmp_path: Path) -> None:
    path = tmp_path / "kept.jsonl"
    Kept(path, {}).close()
    path.write_text(path.read_text() + '{"piece": "one"}\n')
    kept = Kept(path, {})
    assert kept.done == {}
    kept.close()


def test_a_disk_that_knows_no_locks_ends_it_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unsupported(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", unsupported)
    with pytest.raises(ConfigurationError, match="cannot be locked and read: No locks available"):
        Kept(tmp_path / "kept.jsonl", {})


def test_a_torn_line_that_cannot_be_ended_for_want_of_room_ends_it_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "kept.jsonl"
    Kept(path, {}).close()
    path.write_text(path.read_text() + "torn")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, hard))
    try:
        with pytest.raises(FeelaheadError, match="cannot be written: File too large") as caught:
            Kept(path, {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    # It holds the file no more, though the error is still there.
    Kept(path, {}).close()
    assert caught.value is not None


def test_a_full_disk_ends_it_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "kept.jsonl"
    kept = Kept(path, {})
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 10, hard))
    try:
        with pytest.raises(FeelaheadError, match=r"--resume .*kept.jsonl: cannot be written: File too large"):
            kept.keep("one", [])
        kept.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    # What was torn is done again.
    again = Kept(path, {})
    assert again.done == {}
    again.close()
