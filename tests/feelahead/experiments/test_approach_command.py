"""`feelahead try approach` from its flags to its sentence, table, summary and picture; the runs are made up."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import ConfigurationError
from feelahead.experiments.approach import command as module
from feelahead.experiments.approach.command import try_approach
from feelahead.experiments.approach.table import cell, comparison, sentence
from feelahead.lab.approaches.approach import Approach
from feelahead.lab.approaches.frozen import AHEAD, ASIDE, frozen_hash
from feelahead.lab.approaches.laws import LAWS, Law
from feelahead.lab.approaches.outcome import End, Outcome, Trace
from feelahead.lab.figures import LAW_COLOURS
from tests.helpers.repository import DATA

WALL = str(DATA / "wall.xml")


def outcome(end: End = "contact", figure: float = 150.0, turns: int = 1) -> Outcome:
    """One that ends as said: with a contact at so many mm/s, or standing so many mm off."""
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
    """Takes the place of the runs, and remembers which ones were asked for."""

    def __init__(self) -> None:
        self.asked: list[Approach] = []
        self.ends: dict[float, Outcome] = {}
        """By force; a contact for all others."""

    def run(self, approach: Approach) -> Outcome:
        self.asked.append(approach)
        return self.ends.get(approach.force_n, outcome())


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> MadeUp:
    made_up = MadeUp()
    monkeypatch.setattr(module, "run_approach", made_up.run)
    return made_up


def tried(*arguments: str) -> int:
    return try_approach(["--workers", "1", *arguments])


# What is run


@pytest.mark.usefixtures("runs")
def test_one_run_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    assert tried("--model", WALL, "--link", "delay 200ms") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "3 N in wall, law swept: touches wall at 150 mm/s after 0.02 s; least gap -0.1 mm, reversals 1" in said
    assert frozen_hash() in said


def test_every_flag_reaches_the_run(runs: MadeUp) -> None:
    arguments = "--force 2.5 --site grip --strongest-effect 3 --link-model stream --law paper --probability 0.9"
    more = "--duration 4 --seed 7 --grip --spoil swapped --stick 0.5 -0.5 --turn 0 1 --assist speed --camera-mm 1"
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
            spoil="swapped",
            stick=(0.5, -0.5),
            turn=(0.0, 1.0),
            assist="speed",
            camera_sd_m=0.001,
        )
    ]


def test_without_haptics_is_law_none_whatever_the_laws(runs: MadeUp) -> None:
    assert tried("--model", WALL, "--no-haptics") == 0
    assert tried("--model", WALL, "--law", "none") == 0
    assert tried("--model", WALL, "--no-haptics", "--law", "swept", "paper", "--compensation", "operator", "robot") == 0
    assert [one.law for one in runs.asked] == ["none"] * 3


@pytest.mark.parametrize(
    ("flags", "laws"),
    [
        ("", ["swept"]),
        ("--compensation robot", ["swept_robot"]),
        ("--compensation operator robot", ["swept", "swept_robot"]),
        # The paper's law has eq. 8 whoever is asked, and without a field nobody reckons.
        ("--law paper --compensation operator robot", ["paper"]),
        ("--law none full --compensation robot", ["none", "full"]),
        ("--law swept paper none full", ["swept", "paper", "none", "full"]),
        ("--law none swept paper --compensation robot operator", ["none", "swept_robot", "swept", "paper"]),
    ],
)
def test_who_reckons_with_the_delay_doubles_the_law_that_leaves_the_choice(
    runs: MadeUp, flags: str, laws: list[Law]
) -> None:
    assert tried("--model", WALL, *flags.split()) == 0
    assert [one.law for one in runs.asked] == laws


def test_without_a_model_it_is_every_frozen_scene_that_is_ahead(runs: MadeUp) -> None:
    assert tried() == 0
    assert [one.model.stem for one in runs.asked] == [*AHEAD, *ASIDE]
    aside = {one.model.stem: (one.stick, one.turn) for one in runs.asked if (one.stick, one.turn) != ((0, 0), (0, 0))}
    assert aside == ASIDE
    assert [one.model.stem for one in runs.asked if one.grip] == ["place_held"]


def test_values_are_combined_and_seeds_counted(runs: MadeUp) -> None:
    many = "--force 2 3 --law swept none --strongest-effect 1.5 2 --seeds 3 --seed 4"
    assert tried("--model", WALL, str(DATA / "plate.xml"), "--link", "", "delay 5ms", *many.split()) == 0
    assert len(runs.asked) == len(set(runs.asked)) == 2**5 * 3
    assert {one.seed for one in runs.asked} == {4, 5, 6}


def test_settings_may_come_from_a_file(runs: MadeUp, tmp_path: Path) -> None:
    path = tmp_path / "try.toml"
    path.write_text(f'model = ["{WALL}"]\nforce = [2.0, 3.0]\nlink = ["delay 5ms"]\ncompensation = ["robot"]\n')
    assert tried("--config", str(path), "--force", "3.7") == 0
    assert tried("--config", str(path), "--force", "3.7", "--no-haptics") == 0
    for one, law in zip(runs.asked, ("swept_robot", "none"), strict=True):
        assert (one.model, one.force_n, one.link, one.law) == (Path(WALL), 3.7, "delay 5ms", law)


# What comes out


def test_one_run_is_its_own_summary(runs: MadeUp, tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    assert tried("--model", WALL, "--force", "3", "--link", "delay 200ms", "--no-haptics", "--summary", str(path)) == 0
    summary: dict[str, Any] = json.loads(path.read_text())
    known = {
        "model": WALL,
        "site": "tool",
        "force_n": 3.0,
        "strongest_n": 2.0,
        "link": "delay 200ms",
        "link_model": "datagram",
        "law": "none",
        "haptics": False,
        "compensation": "operator",
        "probability": 0.99,
        "duration_s": 8.0,
        "seed": 0,
        "grip": False,
        "spoil": "nothing",
        "end": "contact",
        "contact_speed_mm_s": 150.0,
        "contact_with": "wall",
        "least_gap_mm": -0.1,
        "stops_at_mm": None,
        "way_left_mm": None,
        "reversals": 1,
        "ended_s": 0.02,
        "frozen": frozen_hash(),
    }
    assert {key: summary.get(key) for key in known} == known
    assert summary["trace"]["speed_m_s"] == [0.0, 0.1, 0.15]
    assert [len(row) for row in summary["trace"]["strengths"]] == [10, 10, 10]
    assert summary["trace"].keys() == {"time_s", "speed_m_s", "gap_m", "travel", "strengths"}
    assert "runs" not in summary
    assert len(runs.asked) == 1


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize(
    ("flags", "law", "compensation", "haptics"),
    [
        ("", "swept", "operator", True),
        ("--compensation robot", "swept", "robot", True),
        ("--law paper", "paper", "robot", True),
        ("--law full", "full", "operator", True),
        ("--law none", "none", "operator", False),
    ],
)
def test_the_summary_says_it_in_the_flags_words(
    tmp_path: Path, flags: str, law: str, compensation: str, *, haptics: bool
) -> None:
    path = tmp_path / "summary.json"
    assert tried("--model", WALL, *flags.split(), "--summary", str(path)) == 0
    summary = json.loads(path.read_text())
    assert [summary[key] for key in ("law", "compensation", "haptics")] == [law, compensation, haptics]


@pytest.mark.parametrize("many", [("--force", "2", "3"), ("--link", "", "delay 5ms"), ("--seeds", "2")])
def test_several_runs_are_a_table_and_a_list(
    runs: MadeUp, tmp_path: Path, capsys: pytest.CaptureFixture[str], many: tuple[str, ...]
) -> None:
    path = tmp_path / "summary.json"
    runs.ends[2.0] = outcome("stopped", 5.0)
    assert tried("--model", WALL, *many, "--summary", str(path)) == 0
    summary = json.loads(path.read_text())
    assert summary.keys() == {"runs", "frozen"}
    assert [(one["force_n"], one["link"], one["seed"]) for one in summary["runs"]] == [
        (one.force_n, one.link, one.seed) for one in runs.asked
    ]
    assert [one["stops_at_mm"] for one in summary["runs"]] == [
        5.0 if one.force_n == 2.0 else None for one in runs.asked
    ]
    text = capsys.readouterr().out
    assert "wall" in text
    assert "150 mm/s" in text
    assert frozen_hash() in text


def test_an_undecided_run_fails_and_is_written_down(runs: MadeUp, tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    runs.ends[2.0] = outcome("undecided", 80.0)
    assert tried("--model", WALL, "--force", "2", "--summary", str(path)) == 1
    summary = json.loads(path.read_text())
    assert [summary[key] for key in ("end", "contact_speed_mm_s", "stops_at_mm")] == ["undecided", None, None]
    assert tried("--model", WALL, "--force", "2", "3") == 1
    assert tried("--model", WALL, "--force", "3") == 0
    runs.ends[2.0] = outcome("stopped", 80.0)
    assert tried("--model", WALL, "--force", "2") == 0


@pytest.mark.usefixtures("runs")
def test_the_summary_covers_a_model_of_ones_own(tmp_path: Path) -> None:
    mine, path = tmp_path / "mine.xml", tmp_path / "summary.json"
    mine.write_text("<mujoco/>")
    assert tried("--model", str(mine), "--summary", str(path)) == 0
    assert json.loads(path.read_text())["frozen"] == frozen_hash([mine]) != frozen_hash()


@pytest.mark.usefixtures("runs")
@pytest.mark.parametrize("forces", [("3",), ("2", "3")])
@pytest.mark.parametrize("ending", ["png", "svg"])
def test_a_picture_is_drawn(tmp_path: Path, forces: tuple[str, ...], ending: str) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / f"picture.{ending}"
    assert tried("--model", WALL, "--force", *forces, "--picture", str(path)) == 0
    begins = {"png": b"\x89PNG", "svg": b"<?xml"}[ending]
    assert path.read_bytes().startswith(begins)
    assert len(path.read_bytes()) > 5000


@pytest.mark.usefixtures("runs")
def test_every_law_has_a_line_of_its_own(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "picture.svg"
    flags = "--law swept paper none full --compensation operator robot --link"
    assert tried("--model", WALL, *flags.split(), "", "delay 50ms", "--picture", str(path)) == 0
    drawn = path.read_text()
    for law in ("swept", "swept_robot", "paper", "none", "full"):
        assert LAW_COLOURS[law] in drawn
    assert len({LAW_COLOURS[law] for law in LAWS}) == len(LAWS)


def test_a_picture_of_undecided_runs_is_drawn_as_well(runs: MadeUp, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    runs.ends = {2.0: outcome("undecided"), 3.0: outcome("undecided")}
    path = tmp_path / "picture.png"
    assert tried("--model", WALL, "--force", "2", "3", "--picture", str(path)) == 1
    assert tried("--model", WALL, "--force", "2", "--picture", str(path)) == 1
    assert path.stat().st_size > 5000


# Words


def test_each_end_has_its_sentence() -> None:
    approach = Approach(Path("some/wall.xml"), 3.0, law="none")
    assert "touches wall at 150 mm/s" in sentence(approach, outcome())
    stopped = sentence(approach, outcome("stopped", 5.0))
    assert "stops 5.0 mm off (6.0 mm along the approach)" in stopped
    assert "undecided" in sentence(approach, outcome("undecided"))


def test_a_cell_counts_what_ended_how() -> None:
    ends = [outcome(figure=140.0), outcome(figure=150.0), outcome("stopped", 5.0), outcome("undecided", turns=9)]
    assert cell(ends) == "2/4 at 145 [140 to 150] mm/s, 1/4 stop 5.0 mm off, 1/4 ?, R 9"
    assert cell([outcome(figure=140.1), outcome(figure=139.9)]) == "2/2 at 140 mm/s, R 1"
    assert cell([]) == ""


def test_the_table_has_a_row_for_each_scene_link_and_force_and_a_column_for_each_law() -> None:
    laws: tuple[Law, ...] = ("swept", "swept_robot", "none")
    ended = [
        (Approach(Path(f"{scene}.xml"), force_n, law=law), outcome(figure=100.0 * force_n))
        for scene in ("wall", "plate")
        for force_n in (2.0, 3.0)
        for law in laws
    ]
    table = comparison(ended)
    assert table.row_count == 4
    shown = ["swept", "swept, delay by the robot", "none"]
    assert [column.header for column in table.columns] == ["scene", "link", "N", *shown]
    assert [str(text) for text in table.columns[-1].cells] == [
        f"1/1 at {speed} mm/s, R 1" for speed in (200, 300, 200, 300)
    ]


@pytest.mark.usefixtures("runs")
def test_the_table_says_what_its_figures_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert tried("--model", WALL, "--force", "2", "3") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "[least to greatest]" in said


@pytest.mark.usefixtures("runs")
def test_scenes_of_one_name_in_two_folders_are_two_rows(tmp_path: Path) -> None:
    paths = [tmp_path / folder / "wall.xml" for folder in ("near", "far")]
    assert comparison([(Approach(path, 3.0), outcome()) for path in paths]).row_count == 2


@pytest.mark.parametrize("name", ["[/wall]", "[red]wall", "wall [2 m]"])
def test_names_are_printed_as_they_are(runs: MadeUp, capsys: pytest.CaptureFixture[str], name: str) -> None:
    named = outcome()
    object.__setattr__(named, "contact_with", name)
    runs.ends[3.0] = named
    assert tried("--model", WALL) == 0
    assert f"touches {name} at" in " ".join(capsys.readouterr().out.split())


# Bad input


@pytest.fixture
def no_runs(monkeypatch: pytest.MonkeyPatch) -> Iterator[MadeUp]:
    """Whatever is wrong is said before anything runs."""
    made_up = MadeUp()
    monkeypatch.setattr(module, "run_approach", made_up.run)
    yield made_up
    assert made_up.asked == []


@pytest.mark.usefixtures("no_runs")
@pytest.mark.parametrize(
    ("arguments", "named", "valid"),
    [
        (["--force", "nan"], "--force nan", "0 to 20"),
        (["--force", "21"], "--force 21", "0 to 20"),
        (["--force=-1"], "--force -1", "0 to 20"),
        (["--force", "3", "inf"], "--force inf", "0 to 20"),
        (["--force", "much"], "much", "a number"),
        (["--force"], "--force", "one value or more"),
        (["--strongest-effect", "-0.1"], "-0.1", "0 to 20"),
        (["--strongest-effect"], "--strongest-effect", "one value or more"),
        (["--link", "dealy 5ms"], "dealy", "delay"),
        (["--link", "", "delay -5ms"], "-5ms", "0"),
        (["--link", "delay 1s"], "delay 1s", "below 2 s"),
        (["--link", "to_robot: delay 1500ms; to_operator: delay 600ms"], "2.1 s", "below 2 s"),
        (["--link"], "--link", "one value or more"),
        (["--link-model", "tcp"], "tcp", "datagram"),
        (["--law", "first"], "first", "swept"),
        (["--law", "margin"], "margin", "swept"),
        (["--law", "swept_robot"], "swept_robot", "swept"),
        (["--law"], "--law", "one value or more"),
        (["--compensation"], "--compensation", "one value or more"),
        (["--compensation", "nobody"], "nobody", "robot"),
        (["--probability", "1"], "1.0", "above 0 and below 1"),
        (["--probability", "0"], "0.0", "above 0 and below 1"),
        (["--probability", "nan"], "nan", "above 0 and below 1"),
        (["--duration", "0"], "--duration 0", "0.05 to 1000"),
        (["--duration", "inf"], "inf", "0.05 to 1000"),
        (["--seed", "-1"], "--seed -1", "0 or more"),
        (["--seed", "1.5"], "1.5", "a whole number"),
        (["--seeds", "0"], "--seeds 0", "1 or more"),
        (["--workers", "0"], "--workers 0", "1 or more"),
        (["--spoil", "everything"], "everything", "swapped"),
        (["--summary", "."], ".", "a file's path"),
        (["--summary", "no/such/folder/out.json"], "no/such/folder", "a file's path"),
        (["--picture", "no/such/folder/out.png"], "no/such/folder", "a file's path"),
        (["--picture", "out.xyz"], "out.xyz", "png"),
        (["--config", "no_such.toml"], "no_such.toml", "cannot be read"),
        (["--model", WALL, "no_such.xml"], "no_such.xml: there is no such file", "MJCF"),
        (["--model", WALL, str(DATA)], f"--model {DATA}: is a directory", "MJCF"),
        (["--forse", "3"], "--forse", "--help"),
    ],
)
def test_one_line_names_the_value_and_what_is_valid(arguments: list[str], named: str, valid: str) -> None:
    if "--model" not in arguments:
        arguments = [*arguments, "--model", WALL]
    with pytest.raises(ConfigurationError) as caught:
        tried(*arguments)
    text = str(caught.value)
    assert "\n" not in text
    assert named in text
    assert valid in text


@pytest.mark.usefixtures("no_runs")
def test_a_bad_file_of_settings_is_named(tmp_path: Path) -> None:
    path = tmp_path / "try.toml"
    for text, named in (("forces = [3.0]", "'forces'; valid: .*force"), ("force = [30.0]", "30.*0 to 20")):
        path.write_text(text)
        with pytest.raises(ConfigurationError, match=named):
            tried("--config", str(path))


@pytest.mark.usefixtures("no_runs")
def test_one_value_in_a_file_where_a_list_should_be_is_explained(tmp_path: Path) -> None:
    path = tmp_path / "try.toml"
    path.write_text("force = 3.0")
    with pytest.raises(ConfigurationError, match="force = 3") as caught:
        tried("--config", str(path))
    assert "Ellipsis" not in str(caught.value)


# Whole


def complaint(*arguments: str) -> tuple[int, str]:
    ended = subprocess.run(
        [sys.executable, "-P", "-m", "feelahead.main", "try", "approach", *arguments],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    return ended.returncode, ended.stderr.strip()


@pytest.mark.processes
def test_bad_input_ends_with_code_2_and_one_line() -> None:
    code, text = complaint("--model", WALL, "--force", "21")
    assert code == 2
    assert re.fullmatch(r"feelahead: --force 21\.0: valid: 0 to 20.*", text)


@pytest.mark.processes
@pytest.mark.long
def test_as_many_workers_as_one_likes_give_the_same_figures(tmp_path: Path) -> None:
    found = []
    for workers in ("1", "2"):
        path = tmp_path / f"{workers}.json"
        arguments = ["--model", WALL, "--force", "3", "3.7", "--duration", "0.1", "--link", "delay 5ms 2ms"]
        assert try_approach([*arguments, "--workers", workers, "--summary", str(path)]) == 1  # nobody gets anywhere
        found.append(json.loads(path.read_text()))
    assert found[0] == found[1]
    assert [one["force_n"] for one in found[0]["runs"]] == [3.0, 3.7]
    assert found[0]["runs"][0]["least_gap_mm"] > found[0]["runs"][1]["least_gap_mm"]
