import csv
import io
from pathlib import Path

import pytest
from rich.console import Console

from common.errors import ConfigurationError
from feelahead.experiments import haptics_on_off
from feelahead.experiments.haptics_on_off import ComparisonSettings, Outcome, run, table

pytestmark = pytest.mark.long


def outcome(seed: int, *, haptics: bool, grasp_s: float | None, contacts: int = 0) -> Outcome:
    return Outcome(
        seed,
        haptics,
        obstacle_contacts=contacts,
        target_contacts=1,
        min_obstacle_distance_mm=10.0,
        time_to_grasp_s=grasp_s,
        lifted_mm=100.0,
        mean_enlargement_moving_mm=8.0,
    )


def printed(outcomes: list[Outcome]) -> str:
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(table(outcomes))
    return console.export_text()


def test_the_table_pairs_off_and_on_and_counts_what_never_happened() -> None:
    text = printed(
        [
            outcome(0, haptics=False, grasp_s=4.0, contacts=2),
            outcome(0, haptics=True, grasp_s=5.0, contacts=1),
            outcome(1, haptics=False, grasp_s=6.0, contacts=3),
            outcome(1, haptics=True, grasp_s=None, contacts=0),
        ]
    )
    assert "4.00 / 5.00" in text
    assert "6.00 / never" in text
    assert "5.00 / 5.00 (1 never)" in text
    assert "5 / 1" in text


def test_a_run_is_repeatable_and_differs_by_nothing_but_haptics_at_first() -> None:
    settings = ComparisonSettings(link="delay 20ms", seeds=1, duration=1.0)
    without, again, felt = (
        run(settings, 3, haptics=False),
        run(settings, 3, haptics=False),
        run(settings, 3, haptics=True),
    )
    assert without == again
    assert without.min_obstacle_distance_mm == felt.min_obstacle_distance_mm


def test_the_command_prints_a_table_and_writes_every_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "runs.csv"
    arguments = ["--seeds", "1", "--duration", "0.2", "--workers", "1", "--link", "", "--csv", str(path)]
    assert haptics_on_off.try_haptics(arguments) == 0
    assert "haptics off / on" in capsys.readouterr().out
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["seed"], row["haptics"]) for row in rows] == [("0", "False"), ("0", "True")]


@pytest.mark.parametrize(
    "arguments", [["--seeds", "0"], ["--workers", "0"], ["--duration", "-1"], ["--link", "nonsense"]]
)
def test_bad_settings_are_named(arguments: list[str]) -> None:
    with pytest.raises(ConfigurationError, match=arguments[1]):
        haptics_on_off.try_haptics(arguments)
