"""The marked tables of docs/ come from stored figures."""

import re
from pathlib import Path

import pytest

from feelahead.lab.measurements import approaches, coverages, studies
from feelahead.lab.measurements.documents import DOCUMENTS, FIGURES, MARKED, TABLES, written
from feelahead.lab.table import Table
from tests.helpers.repository import ROOT

TEXTS = {document.name: document.read_text(encoding="utf-8") for document in DOCUMENTS}
ALL = "\n".join(TEXTS.values())
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")


def test_every_table_stands_between_markers_and_below_the_command_that_make_figures_runs() -> None:
    assert not re.search(r"^\|", MARKED.sub("", TEXTS["measurements.md"]), re.MULTILINE)
    assert sorted(found["name"] for found in MARKED.finditer(ALL)) == sorted(TABLES)
    asked = dict(re.findall(r"^figures/(\w+)\.csv: asks = (.+)$", _joined(MAKEFILE), re.MULTILINE))
    above = re.findall(r"^    feelahead (.+)\n\n<!-- (\w+): by make figures -->$", _joined(ALL), re.MULTILINE)
    assert {name: command for command, name in above} == asked
    commits = {line.split()[0] for line in (FIGURES / "commits").read_text().splitlines()}
    assert commits == asked.keys() | {"contrasts"}
    assert commits == {path.stem for path in FIGURES.glob("*.csv")}


def _joined(text: str) -> str:
    """Return the text with lines that a backslash continues as one."""
    return re.sub(r" \\\n\s+", " ", text)


def test_no_other_document_has_marked_tables() -> None:
    marked = {path for path in (ROOT / "docs").rglob("*.md") if MARKED.search(path.read_text(encoding="utf-8"))}
    assert marked == {*DOCUMENTS}


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_the_tables_are_those_of_the_stored_figures(text: str) -> None:
    assert written(text) == text


def test_a_figure_copied_by_hand_does_not_last(tmp_path: Path) -> None:
    (tmp_path / "commits").write_text("cover 0123abcd\n")
    (tmp_path / "cover.csv").write_text("part,spheres,sticks_out_mm,stands_out_mm\npalm,7,0.0,2.5\ntip,3,0.1,1.0\n")
    marked = "Before\n<!-- {}: by make figures -->\n| by hand | 99 |\n<!-- end -->\nAfter\n"
    once = written(marked.format("cover"), tmp_path)
    assert "99" not in once
    assert "Commit 0123abcd:\n\n| part |" in once
    assert "\n| all | 10 | 0.1 | 2.5 |\n<!-- end -->\nAfter\n" in once
    assert written(once, tmp_path) == once
    without_figures = marked.format("demo")
    assert written(without_figures, tmp_path) == without_figures


def test_intervals_of_haptics_resample_seeds_and_not_trials(tmp_path: Path) -> None:
    (tmp_path / "commits").write_text("haptics 0123abcd\n")
    rows = [
        {
            "scene": "wall",
            "delay_ms": delay_ms,
            "arm": arm,
            "seed": seed,
            "hits": int(arm == "off" and seed == 0),
            "fastest_hit_mm_s": 50.0 + delay_ms if arm == "off" and seed == 0 else None,
            "full_share": None if arm == "off" else 0.25,
            "placed": arm != "off" or seed == 1,
            "finished_s": None if arm == "off" and seed == 0 else 20.0 + seed,  # None counts as 45 s
        }
        for delay_ms in (0.0, 100.0)
        for arm in ("off", "mechanical", "reacting")
        for seed in (0, 1)
    ]
    Table(rows).write_csv(tmp_path / "haptics.csv")
    lines = written("<!-- haptics: by make figures -->\n<!-- end -->", tmp_path).splitlines()
    assert lines[5] == (
        "| wall, 0 ms | 1/2 at 50 (50) | 0/2 | 0/2 | 1 / 2 / 2 | 33.0 / 20.5 / 20.5"
        " | -12.5 [-25.0, +0.0] | -12.5 [-25.0, +0.0] | 25 % / 25 % |"
    )
    # Four pairs of two seeds: as wide as for one delay.
    assert lines[7].startswith("| **wall, all** | 2/4 at 100 (150) | 0/4 | 0/4 | 2 / 4 / 4 |")
    assert "| -12.5 [-25.0, +0.0] |" in lines[7]


def test_a_cell_by_depth_that_does_not_hold_is_bold_with_its_lower_end() -> None:
    seen = {"scene": "wall", "coverage": 0.95, "low": 0.88, "alarms_per_min": 4.4, "holds": False}
    cells = [
        seen | {"seen_by": "objects", "coverage": 1.0, "holds": True},
        seen | {"seen_by": "wrist, noise x1, mount 2 mm"},
        seen | {"seen_by": "both, noise x2, mount 2 mm", "coverage": 0.993, "holds": True},
    ]
    _, *lines = map(list, coverages.depth(Table(cells)))
    assert lines == [["wall", "1.00, 4", "", "**0.95 [0.88]**, 4", ""]]
    _, *others = map(list, coverages.other_errors(Table(cells)))
    assert others == [["wall", "both", "", "0.99, 4", "", ""]]


def test_an_approach_that_touches_in_one_of_two_runs_says_so() -> None:
    run = {"model": "tests/data/ball.xml", "force_n": 2.0, "compensation": "operator"}
    near, far = {"link": "delay 0ms"}, {"link": "delay 50ms"}
    stops = {"stops_at_mm": 7.0, "contact_speed_mm_s": None, "end": "stopped"}
    touches = {"stops_at_mm": None, "contact_speed_mm_s": 72.0, "end": "contact"}
    moves = {"stops_at_mm": None, "contact_speed_mm_s": None, "end": "undecided"}
    swept = [run | {"law": "swept"} | of for of in (near | stops, near | touches, far | stops, far | moves)]
    none = [run | {"law": "none"} | touches | link for link in (near, far)]
    _, *lines = map(list, approaches.approach(Table([*swept, *none])))
    assert lines == [["ball", "2", "hits at 72", "7.0, 1 hit / 7.0, 1 undecided", "", ""]]


def test_hits_of_a_study_are_counted_over_its_delays() -> None:
    cell = {"condition": "off", "trials": 72.0}
    values = {"hit": (0.25, 0.125), "completed": (0.5, 1.0), "time_s": (20.04, 30.0)}
    cells = [
        cell | {"outcome": outcome, "delay_ms": delay_ms, "value": value}
        for outcome, of in values.items()
        for delay_ms, value in zip((100.0, 0.0), of, strict=True)
    ]
    heading, line = map(list, studies.outcomes(Table(cells)))
    assert heading[2] == "completed, %: 0 / 100 ms"
    assert line == ["off", "27 of 144", "100 / 50", "30.0 / 20.0"]
