"""Every column that an export can have is in the dictionary, with a unit; the document shows the same dictionary."""

import pytest

from feelahead.commands.recordings import export
from feelahead.recordings.dictionary import JOINED, KINDS, Column, column_of, columns_of, dictionary, every_table
from tests.helpers.repository import ROOT

EVERY = [(table, column) for table in KINDS for column in columns_of(table).values()]


@pytest.mark.parametrize(("table", "column"), EVERY, ids=[f"{table}.{column.name}" for table, column in EVERY])
def test_every_column_has_a_unit_and_a_meaning_and_a_length_or_direction_its_frame(table: str, column: Column) -> None:
    assert column.unit
    assert column.meaning, f"{table}.{column.name}: write a text below the field"
    directed = column.of in (2, 3) and column.unit == "1"
    if directed or column.unit.partition(",")[0] in ("m", "mm", "mm³", "m/s", "m/s²", "rad", "rad/s"):
        assert column.frame, f"{table}.{column.name}: say in which frame, or along what"


@pytest.mark.parametrize(
    ("table", "name", "unit", "frame", "said"),
    [
        ("telemetry", "tool_position_m.2", "m", "world", "Estimated position"),
        ("stiffness", "r2.fast_m.7", "m", "the trigger", "strengths 1 to 8"),
        (JOINED, "stiffness.r2.course_stiffness", "1", "the trigger", "not what the trigger meets now"),
        (JOINED, "controller.r2_meets", "1", "", "what the finger feels now"),
        ("overlap", "a cup.0.r2_mm3", "mm³", "R2", "eq. 11-12"),
        ("operator_facts", "status.R2_pulled", "1", "", "travel of R2"),
        ("operator_facts", "screen.holding", "0 or 1", "", "between the fingers"),
        ("robot_status", "of another version", "?", "", "unknown"),
        ("nothing", "x", "?", "", "unknown"),
    ],
)
def test_a_column_is_found_by_its_name_in_a_file(table: str, name: str, unit: str, frame: str, said: str) -> None:
    found = column_of(table, name)
    assert (found.unit, found.frame) == (unit, frame)
    assert said in found.meaning


def test_packed_numbers_are_in_no_table() -> None:
    names = {name for _, names in every_table() for name in names}
    assert not [name for name in names if "around" in name or "header" in name]


def test_the_document_is_what_the_command_prints(capsys: pytest.CaptureFixture[str]) -> None:
    assert export(["--columns"]) == 0
    printed = capsys.readouterr().out
    assert printed == dictionary(every_table())
    rows = [line.replace(r"\|", "") for line in printed.splitlines() if line.startswith("|")]
    assert {row.count("|") for row in rows} == {5}
    document = ROOT / "docs" / "recording" / "columns.md"
    assert document.read_text(encoding="utf-8") == printed, "feelahead export --columns > docs/recording/columns.md"
