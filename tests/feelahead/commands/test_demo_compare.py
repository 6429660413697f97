"""The comparison of a run without and with haptics: what it refuses, computes and shows."""

import json
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from feelahead.commands.demo.command import demo
from feelahead.commands.demo.compare import page_of
from feelahead.commands.demo.settings import DemoSettings


@pytest.mark.parametrize(
    "flag", ["--no-haptics", "--compensation=robot", "--tui", "--record=run.mcap", "--status=json"]
)
def test_what_means_nothing_here_is_refused(flag: str) -> None:
    with pytest.raises(ConfigurationError, match=r"with --compare; valid: --compare, --config"):
        demo(["--compare", flag])


@pytest.mark.long
def test_the_wall_is_hit_without_haptics_and_not_with_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    summary = tmp_path / "summary.json"
    asked = ["--compare", "--no-console", "--link=delay 200ms", "--duration=10", f"--summary={summary}"]
    assert demo(asked) == 0
    runs = json.loads(summary.read_text())
    assert runs["scene"] == "wall"
    assert runs["off"]["hit_first"] == "wall"
    assert runs["off"]["fastest_hit_mm_s"] > 50.0
    assert runs["on"]["hits"] == 0
    assert runs["on"]["least_gap_mm"] > 5.0
    off, on = (line for line in capsys.readouterr().out.splitlines() if line.startswith(("| off ", "| on ")))
    assert "wall" in off
    assert "none" in on


def test_no_text_ends_the_pages_script() -> None:
    page = page_of(DemoSettings(link=""), [{"name": "</script><b>", "trouble": "<!--"}])
    assert page.count("</script>") == 1
    assert "<b>" not in page
    assert "<!--" not in page
