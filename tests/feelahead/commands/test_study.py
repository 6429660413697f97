from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from common.errors import ConfigurationError
from feelahead.commands.study.command import study
from feelahead.study.folder import Study
from feelahead.study.protocol import load_protocol
from tests.feelahead.study.driving import do_all, do_step
from tests.feelahead.study.made_up import PROTOCOL, made_up
from tests.helpers.refusal import refusal
from tests.helpers.repository import ROOT

EXAMPLE = ROOT / "examples" / "study.toml"


@pytest.fixture(autouse=True)
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "120")


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> list[int | None]:
    """Numbers for which pages were served; none is served."""
    numbers: list[int | None] = []
    monkeypatch.setattr("feelahead.commands.study.people.run_people", lambda _, number: numbers.append(number))
    return numbers


def test_the_check_of_the_example_shows_its_balance_and_its_minutes(capsys: pytest.CaptureFixture[str]) -> None:
    assert study(["check", str(EXAMPLE)]) == 0
    said = capsys.readouterr().out
    assert "| assist    | 4 | 4 | 4 | 4 | 4 |" in said
    assert "| assist    |         4 |           4 |           4 |            4 |            - |" in said
    assert "Balanced: 20 participants are a multiple of 10." in said
    assert "Each delay stands 6 to 8 times at each place under each condition." in said
    assert "A participant has 60 trials." in said
    # 12 tries and 60 trials of 45 s, 4 rests of 60 s, 8 questions after each of 5 blocks.
    assert [f"{minutes:g}" in said for minutes in (9.0, 45.0, 4.0, 6.67, 64.7)] == [True] * 5


@pytest.mark.parametrize(("number", "near"), [(7, "10"), (12, "10 or 20")])
def test_the_check_says_which_numbers_would_be_balanced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], number: int, near: str
) -> None:
    path = tmp_path / "study.toml"
    path.write_text(EXAMPLE.read_text().replace("participants = 20", f"participants = {number}"))
    assert study(["check", str(path)]) == 0
    assert f"Not balanced: {number} is no multiple of 10; valid: {near} participants." in capsys.readouterr().out


def test_a_study_that_was_begun_shows_where_it_is_and_no_condition(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], here: list[int | None]
) -> None:
    folder = tmp_path / "study"
    assert study([str(EXAMPLE), "--out", str(folder)]) == 0
    with Study(folder, EXAMPLE) as opened:
        do_all(opened, 2)
        do_step(opened, 7)
        assert do_step(opened, 7) is not None
    capsys.readouterr()
    assert study([str(EXAMPLE), "--out", str(folder), "--participant", "7"]) == 0
    assert here == [None, 7]
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    words = [[word.strip() for word in row.split("|")[1:-1]] for row in rows]
    assert words[-2:] == [["2", "60", "0", "done"], ["7", "0", "0", "practice"]]


@pytest.mark.parametrize(
    ("simulated", "changed", "words"),
    [
        (False, {}, "--pool: people took part in it"),
        (True, {"limit_s": 30.0}, "--pool: has other limit_s;"),
        (True, {"scenes": ("wall",), "contrasts": ()}, "--pool: has other contrasts, scenes;"),
    ],
)
def test_a_pool_that_cannot_stand_for_the_study_is_refused(
    monkeypatch: pytest.MonkeyPatch, simulated: bool, changed: dict[str, Any], words: str
) -> None:
    made = made_up(people=1)
    pool = replace(made, protocol=replace(load_protocol(EXAMPLE), **changed), simulated=simulated)
    monkeypatch.setattr("feelahead.study.report.reading.read_tables", lambda _: pool)
    assert words in refusal(study, ["plan", str(EXAMPLE), "--pool", "POOL"])


def test_a_pool_of_another_seed_and_number_stands_for_the_study(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planned = replace(PROTOCOL, seed=1, participants=8)
    pool = replace(made_up(people=4), simulated=True)
    monkeypatch.setattr("feelahead.commands.study.command.load_protocol", lambda _: planned)
    monkeypatch.setattr("feelahead.study.report.reading.read_tables", lambda _: pool)
    assert study(["plan", str(EXAMPLE), "--pool", "POOL"]) == 0
    assert "from 4 simulated participants" in capsys.readouterr().out


def test_what_needs_more_packages_names_them(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: str) -> None:
        raise ModuleNotFoundError(name="statsmodels")

    monkeypatch.setattr("feelahead.commands.study.command.import_module", missing)
    with pytest.raises(ConfigurationError, match=r"statsmodels is not installed; to install it: pip install '\.\["):
        study(["plan", str(EXAMPLE)])
