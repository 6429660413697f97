"""Print what LeRobot's arm does, measured: python -m tests.lerobot.table [--only WORDS]."""

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.lerobot.rig import DRIVERS, Rig, missing
from tests.lerobot.trials import FAULTS, approach, fault

LOOPS = ("lerobot_arm.py", "lerobot-teleoperate")
"""Drivers that run until they are ended"""


def main() -> int:
    """Print the table; return 1 if there is no LeRobot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", metavar="WORDS", help="rows whose driver or trial has these words")
    only = parser.parse_args().only
    if (why := missing()) is not None:
        sys.stderr.write(f"tests.lerobot.table: {why}\n")
        return 1
    with tempfile.TemporaryDirectory() as place:
        _say("| driver | pulls with 2 N: left of the way, mm | loop age p50, ms | states a second | refused |")
        _say("|---|---|---|---|---|")
        for driver in (one for one in DRIVERS if only in f"{one} approach"):
            _say(f"| {driver} | {_row(approach_row, driver, Path(place) / f'{driver}-approach')} |")
        _say("")
        _say("| driver | fault | servos stand after, s | meanwhile, mm | its process | operator reads | comes back |")
        _say("|---|---|---|---|---|---|---|")
        rows = ((driver, name) for driver in LOOPS for name in FAULTS if only in f"{driver} {name}")
        for number, (driver, name) in enumerate(rows):
            _say(f"| {driver} | {name} | {_row(fault_row, driver, Path(place) / str(number), FAULTS[name])} |")
    return 0


def approach_row(driver: str, folder: Path) -> str:
    """Return the cells of an approach to the wall."""
    came = approach(driver, folder)
    left = f"{1e3 * came.left_m:.1f} of {1e3 * came.began_m:.0f}"
    return f"{left} | {1e3 * came.loop_age_s:.0f} | {came.states_per_s:.0f} | {came.refused or 0}"


def fault_row(driver: str, folder: Path, strike: Callable[[Rig], None]) -> str:
    """Return the cells of a fault."""
    got = fault(driver, folder, strike)
    process = "goes on" if got.ended is None else f"ends, code {got.ended}: {got.said}"
    figures = f"{got.stood_s:.2f} | {1e3 * got.way_m:.1f} | {process}"
    return f"{figures} | {' → '.join(got.read)} | {'yes' if got.moves_again else 'no'}"


def _row(measured: Callable[..., str], *arguments: Any) -> str:
    try:
        return measured(*arguments)
    except AssertionError as error:  # the other rows are worth their minutes
        return f"not measured: {error}"


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
