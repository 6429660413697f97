import resource
from pathlib import Path

import pytest

from common.errors import ConfigurationError, FeelaheadError
from feelahead.approaches.kept import Kept


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
