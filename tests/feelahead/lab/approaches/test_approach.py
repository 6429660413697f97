"""`feelahead try approach`, from its flags to its sentence, table, summary and figure, mostly with invented runs."""

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from feelahead.lab.approaches.approach import Approach, robot_settings
from feelahead.lab.approaches.frozen import AHEAD, ASIDE, frozen_hash
from feelahead.lab.approaches.laws import LAWS
from feelahead.lab.approaches.outcome import End, Outcome, Trace
from feelahead.lab.questions import approach as module
from feelahead.lab.questions import haptics
from feelahead.lab.questions.approach import QUESTION, figures
from feelahead.lab.sweep import ask
from feelahead.printing.pictures import LAW_COLOURS
from robot_side.laws.paper_settings import PaperSettings
from tests.helpers.refusal import refusal
from tests.helpers.repository import DATA

WALL = str(DATA / "wall.xml")
SEVERAL = ("swept", "swept_robot", "paper", "none", "full")


def outcome(end: End = "contact", figure: float = 150.0, turns: int = 1) -> Outcome:
    """Return an outcome: a contact at `figure` mm/s, or a stop `figure` mm before the object."""
    hits, stops = end == "contact", end == "stopped"
    return Outcome(
        end=end,
        contact_speed_mm_s=figure if hits else None,
        contact_with="wall" if hits else None,
        least_gap_mm=-0.1 if hits else figure,
        stops_at_mm=figure if stops else None,
        way_left_mm=figure + 1.0 if stops else None,
        reversals=turns,
        ended_s=0.02,
        trace=Trace(
            time_s=np.array([0.0, 0.01, 0.02]),
            speed_m_s=np.array([0.0, 0.1, 0.15]),
            gap_m=np.array([0.3, 0.2, 0.0]),
            travel=np.array([0.0, 0.3, 0.5]),
            strengths=np.tile(np.arange(10) % 9, (3, 1)),
        ),
    )


class MadeUp:
    """Replacement for running approaches: it stores their settings and returns given outcomes."""

    def __init__(self) -> None:
        self.asked: list[Approach] = []
        self.ends: dict[float, Outcome] = {}
        """Outcome for each force; other forces end in a contact"""

    def run(self, approach: Approach) -> Outcome:
        self.asked.append(approach)
        return self.ends.get(approach.force_n, outcome())


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> MadeUp:
    made_up = MadeUp()
    monkeypatch.setattr(module, "run_approach", made_up.run)
    return made_up


def tried(*arguments: str) -> int:
    return ask(QUESTION, ["--workers", "1", *arguments])


def row(approach: Approach, ended: Outcome) -> dict[str, Any]:
    columns = {name: value for name, value in vars(approach).items() if name != "model"}
    return columns | {"model": str(approach.model)} | figures(approach, ended)


# Runs


def test_every_flag_reaches_the_run(runs: MadeUp) -> None:
    arguments = "--force 2.5 --site grip --strongest-effect 3 --link-model stream --law paper --probability 0.9"
    more = "--duration 4 --seed 7 --grip --stick 0.5 -0.5 --turn 0 1 --assist speed --camera-mm 1"
    assert tried("--model", WALL, "--link", "delay 5ms", *arguments.split(), *more.split()) == 0
    assert runs.asked == [
        Approach(
            model=Path(WALL),
            force_n=2.5,
            site="grip",
            strongest_n=3.0,
            link="delay 5ms",
            link_model="stream",
            law="paper",
            probability=0.9,
            duration_s=4.0,
            seed=7,
            grip=True,
            stick=(0.5, -0.5),
            turn=(0.0, 1.0),
            assist="speed",
            camera_sd_m=0.001,
        )
    ]
    of_robot = robot_settings(runs.asked[0])
    assert (of_robot.assist, of_robot.law, of_robot.probability, of_robot.seed) == ("speed", "paper", 0.9, 7)


@pytest.mark.parametrize(
    ("flags", "laws"),
    [
        ("", "swept"),
        ("--compensation operator robot", "swept swept_robot"),
        # The paper's law uses eq. 8 on either side, and without a field there is nothing to compensate.
        ("--law paper --compensation operator robot", "paper"),
        ("--law none full --compensation robot", "none full"),
        ("--law none swept paper --compensation robot operator", "none swept_robot swept paper"),
        ("--law swept paper --no-haptics", "none"),
    ],
)
def test_compensation_doubles_the_law_that_leaves_the_choice(runs: MadeUp, flags: str, laws: str) -> None:
    assert tried("--model", WALL, *flags.split()) == 0
    assert [one.law for one in runs.asked] == laws.split()


def test_without_a_model_every_frozen_scene_that_is_ahead_is_tried(runs: MadeUp) -> None:
    assert tried() == 0
    assert [one.model.stem for one in runs.asked] == [*AHEAD, *ASIDE]
    aside = {one.model.stem: (one.stick, one.turn) for one in runs.asked if (one.stick, one.turn) != ((0, 0), (0, 0))}
    assert aside == ASIDE
    assert [one.model.stem for one in runs.asked if one.grip] == ["place_held"]


# Results


def test_one_run_is_a_sentence_and_its_own_summary(
    runs: MadeUp, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "summary.json"
    assert tried("--model", WALL, "--force", "3", "--link", "delay 200ms", "--no-haptics", "--summary", str(path)) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "3 N in wall, law none: touches wall at 150 mm/s after 0.02 s; least gap -0.1 mm, reversals 1" in said
    summary: dict[str, Any] = json.loads(path.read_text())
    contact = {"end": "contact", "contact_speed_mm_s": 150.0, "contact_with": "wall", "least_gap_mm": -0.1}
    asked = {"model": WALL, "site": "tool", "force_n": 3.0, "link": "delay 200ms", "law": "none", "haptics": False}
    ended = {"stops_at_mm": None, "way_left_mm": None, "reversals": 1, "ended_s": 0.02, "frozen": frozen_hash()}
    known = contact | asked | ended | {"strongest_n": 2.0, "compensation": "operator", "probability": 0.99, "seed": 0}
    assert {key: summary.get(key) for key in known} == known
    assert summary["trace"].keys() == {"time_s", "speed_m_s", "gap_m", "travel", "strengths"}
    assert summary["trace"]["speed_m_s"] == [0.0, 0.1, 0.15]
    assert [len(strengths) for strengths in summary["trace"]["strengths"]] == [10, 10, 10]
    assert len(runs.asked) == 1


def test_several_runs_are_a_table_a_list_and_a_figure(
    runs: MadeUp, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, picture = tmp_path / "summary.json", tmp_path / "picture.svg"
    runs.ends[2.0] = outcome("stopped", 5.0)
    laws = "--law swept paper none full --compensation operator robot --force 2 3 --link"
    files = ("--summary", str(path), "--picture", str(picture))
    assert tried("--model", WALL, *laws.split(), "", "delay 50ms", *files) == 0
    summary = json.loads(path.read_text())
    assert summary.keys() == {"runs", "frozen"}
    stops = [5.0 if one.force_n == 2.0 else None for one in runs.asked]
    assert [one["stops_at_mm"] for one in summary["runs"]] == stops
    said = {(one["law"], one["compensation"], one["haptics"]) for one in summary["runs"]}
    assert {("swept", "operator", True), ("swept", "robot", True), ("none", "operator", False)} < said
    text = capsys.readouterr().out
    assert "150 mm/s" in text
    assert frozen_hash() in text
    drawn = picture.read_text()
    assert all(LAW_COLOURS[law] in drawn for law in SEVERAL)
    assert len({LAW_COLOURS[law] for law in LAWS}) == len(LAWS)
    assert "delay each way, ms" in drawn


def test_with_one_delay_the_axis_has_the_laws_and_no_delay_that_none_had(runs: MadeUp, tmp_path: Path) -> None:
    picture = tmp_path / "picture.svg"
    laws = ("--law", "swept", "paper", "--link", "delay 200ms")
    assert tried("--model", WALL, "--force", "3", *laws, "--picture", str(picture)) == 0
    texts = set(re.findall(r"<!-- (.*?) -->", picture.read_text()))
    assert {"swept", f"paper ({PaperSettings()})", "law, at 200 ms each way"} < texts
    assert runs.asked


@pytest.mark.parametrize("end", ["undecided", "failed", "disarmed"])
def test_an_end_that_says_nothing_of_the_law_fails_and_is_drawn_as_well(runs: MadeUp, tmp_path: Path, end: End) -> None:
    runs.ends[2.0] = outcome(end, 80.0)
    for forces in (("2",), ("2", "3")):
        picture = tmp_path / f"{len(forces)}.png"
        assert tried("--model", WALL, "--force", *forces, "--picture", str(picture)) == 1
        assert picture.read_bytes().startswith(b"\x89PNG")
    assert tried("--model", WALL, "--force", "3") == 0


@pytest.mark.parametrize(
    ("arguments", "named", "valid"),
    [
        (["--force", "3", "inf"], "force[1] = inf", "0 to 20"),
        (["--force"], "--force", "one value or more"),
        (["--link", "to_robot: delay 1500ms; to_operator: delay 600ms"], "2.1 s", "below 2 s"),
        (["--law", "swept_robot"], "swept_robot", "swept"),
        (["--stick", "1", "0.1"], "--stick (1.0, 0.1)", "is longer than 1"),
        (["--picture", "out.xyz"], "out.xyz", "png"),
        (["--model", WALL, "no_such.xml"], "no_such.xml: there is no such file", "MJCF"),
    ],
)
def test_bad_input_is_one_line_before_anything_runs(runs: MadeUp, arguments: list[str], named: str, valid: str) -> None:
    text = refusal(tried, *arguments, *(() if "--model" in arguments else ("--model", WALL)))
    assert "Settings" not in text
    assert named in text
    assert valid in text
    assert runs.asked == []


# A whole task instead of one pull


def test_haptics_tells_trials_with_from_those_without(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "trials.csv"
    few = ["--quick", "--workers", "1", "--seeds", "1", "--duration", "3", "--csv", str(path)]
    assert ask(haptics.QUESTION, few) == 0
    assert "on, no notice taken" in capsys.readouterr().out
    rows = list(csv.DictReader(path.read_text().splitlines()))
    assert [row["arm"] for row in rows] == ["off", "mechanical", "reacting"]
    assert all(row["hits"] == "0" and row["placed"] == "False" for row in rows)
