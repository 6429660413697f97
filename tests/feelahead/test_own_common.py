"""A package or file of somebody's that hides ours of the name `common` is named."""

from pathlib import Path

import pytest

from tests.helpers.python_process import ended


@pytest.mark.processes
@pytest.mark.parametrize("hides", ["common.py", "common/__init__.py"])
def test_what_hides_our_package_is_named_with_what_helps(hides: str, tmp_path: Path) -> None:
    other, script = tmp_path / hides, tmp_path / "run.py"
    other.parent.mkdir(exist_ok=True)
    other.write_text("")
    script.write_text("from feelahead import Episode")
    code, _, complaint = ended(str(script))
    assert code == 1
    assert f"hidden by {other}; valid: another name" in complaint.splitlines()[-1]
