"""The comparison of a run without and with haptics: what it refuses, computes and shows."""

import json
import os
import signal
import threading
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from feelahead.commands.demo import compare
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


def test_the_page_is_only_at_its_address(monkeypatch: pytest.MonkeyPatch) -> None:
    answers: list[bytes | int] = []

    def ask(address: str) -> None:
        for asked in (address, address.rsplit("/", 2)[0] + "/", address[:-1] + "x/"):
            try:
                with urllib.request.urlopen(asked, timeout=20.0) as answer:  # noqa: S310
                    answers.append(answer.read())
            except urllib.error.HTTPError as error:
                answers.append(error.code)
                error.close()
        os.kill(os.getpid(), signal.SIGINT)

    def shown(address: str, _: object) -> None:
        threading.Thread(target=ask, args=(address,)).start()

    monkeypatch.setattr(compare, "show_address", shown)
    compare._serve(b"page", 0)
    assert answers == [b"page", 404, 404]


def test_ctrl_c_while_it_computes_is_said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(compare, "compute", interrupted)
    assert demo(["--compare"]) == 130
    assert capsys.readouterr().err == "feelahead demo --compare: interrupted\n"
