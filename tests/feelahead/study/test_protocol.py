import tomllib
from pathlib import Path
from typing import Any

import pytest

from feelahead.study.protocol import load_protocol
from feelahead.study.questionnaires import NASA_TLX, check_answers, raw_tlx
from feelahead.study.schedule import schedule
from tests.feelahead.study.protocols import protocol
from tests.helpers.refusal import refusal
from tests.helpers.repository import ROOT

EXAMPLE = ROOT / "examples" / "study.toml"


def test_the_example_has_the_shape_that_the_documents_promise() -> None:
    found = load_protocol(EXAMPLE)
    assert [*found.conditions] == ["off", "swept", "paper", "margin", "assist"]
    assert found.delays_ms == (0.0, 100.0, 300.0)
    assert found.scenes == ("wall", "slot")
    # A whole number of squares: each condition equally often at each place.
    assert found.participants % 10 == 0
    assert len(schedule(found, 1)) == 5 * 3 * 2 * found.trials


def test_the_simulated_example_is_a_whole_number_of_squares() -> None:
    found = load_protocol(ROOT / "examples" / "simulated_study.toml")
    assert [*found.conditions] == ["off", "swept", "paper", "margin"]
    assert (found.participants % 4, len(schedule(found, 1))) == (0, 4 * 3 * 2 * 3)


def test_the_hash_is_of_what_is_said_and_not_of_how(tmp_path: Path) -> None:
    same, other = tmp_path / "same.toml", tmp_path / "other.toml"
    same.write_text("# a comment\n\n" + EXAMPLE.read_text())
    other.write_text(EXAMPLE.read_text().replace("seed = 53", "seed = 54"))
    assert load_protocol(same).hash == load_protocol(EXAMPLE).hash != load_protocol(other).hash
    turned = dict(reversed(protocol().conditions.items()))
    assert protocol(conditions=turned).hash != protocol().hash


@pytest.mark.parametrize(
    ("line", "instead", "named", "valid"),
    [
        ('name = "What', 'title = "What', "unknown key 'title'", "withdrawn"),
        ("participants = 20", "participants = 0", "participants = 0", "1 to 999"),
        ('controller = "dualsense"', 'controller = "mouse"', 'controller = "mouse"', '"keyboard"'),
        ('["wall", "slot"]', '["wall", "hall"]', '"hall"', '"table"'),
        ('["wall", "slot"]', '["wall", "wall"]', "scenes: wall stands there twice", "each once"),
        ("[0.0, 100.0, 300.0]", "[]", "delays_ms: none", "one or more"),
        ("[0.0, 100.0, 300.0]", "[0.0, -1.0]", "delays_ms", "0 to 2000"),
        ("[conditions.off]", "[conditions.Off]", "conditions.Off", "lower letters"),
        ("haptics = false", "haptic = false", "unknown key 'conditions.off.haptic'", "haptics"),
        ("haptics = false", "haptics = 0", "conditions.off.haptics = 0", "true or false"),
        ('law = "paper"', 'law = "papers"', "conditions.paper: law 'papers'", "swept"),
        ("margin_m = 0.05", "", "conditions.margin: margin_m = None", "both"),
        ("margin_m = 0.05", "margin_m = 0.0", "conditions.margin.margin_m = 0.0", "above 0"),
        ('condition = "off"', 'condition = "none"', "practice.condition = 'none'", "off, swept"),
        ("successes = 3", "successes = 13", "practice: successes = 13", "at most the 12"),
        ('outcome = "time_s"', 'outcome = "times"', "contrasts[3].outcome = 'times'", "time_s"),
        ('first = "assist"', 'first = "help"', "contrasts[5].first = 'help'", "assist"),
        ('first = "assist"', 'best = "assist"', "unknown key 'contrasts[5].best'", "first"),
        ('first = "assist"\nsecond = "swept"', 'first = "swept"\nsecond = "swept"', "second = 'swept'", "off, paper"),
        ("tlx = true", "tlx = false", "contrasts[6].outcome = 'tlx'", "hit"),
        ('text = "The triggers hindered me."', 'text = ""', 'items[1].text = ""', "1"),
        ('"The triggers hindered me."', '"The triggers hindered me."\npoints = 1', "items[1].points = 1", "2 to 11"),
    ],
)
def test_a_bad_protocol_is_one_clear_line(tmp_path: Path, line: str, instead: str, named: str, valid: str) -> None:
    path, text = tmp_path / "study.toml", EXAMPLE.read_text()
    assert line in text
    path.write_text(text.replace(line, instead, 1))
    tomllib.loads(path.read_text())
    said = refusal(load_protocol, path)
    assert said.startswith(f"protocol {path}: ")
    assert named in said
    assert valid in said.partition("valid: ")[2]


def test_a_protocol_that_is_not_there_is_named(tmp_path: Path) -> None:
    assert "none.toml: cannot be read" in refusal(load_protocol, tmp_path / "none.toml")


def test_the_raw_score_is_the_mean_of_six_and_absent_is_not_zero() -> None:
    answers = {item.name: 5.0 * number for number, item in enumerate(NASA_TLX)}
    assert raw_tlx(answers) == 12.5
    assert raw_tlx(dict(list(answers.items())[1:])) is None
    assert {item.values for item in NASA_TLX} == {tuple(range(0, 101, 5))}


@pytest.mark.parametrize(
    ("answers", "named"),
    [
        ({}, "It helped.: missing; valid: 1, 2 ... 7"),
        ({"It helped.": 8.0}, "It helped.: 8; valid"),
        ({"It helped.": 1.5}, "It helped.: 1.5; valid"),
        ({"It helped.": float("nan")}, "It helped.: nan; valid"),
        ({"It helped.": 7.0, "more": 1.0}, "more: not asked; valid: It helped."),
    ],
)
def test_answers_are_all_there_and_valid(answers: dict[str, Any], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        check_answers(protocol().questions, answers)
    check_answers(protocol().questions, {"It helped.": 7.0})
