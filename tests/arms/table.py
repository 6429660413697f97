"""Print the table of docs/drivers.md: each driver of docs/drivers with its real peer, a wall, a grasp and faults.

python -m tests.arms.table [--peers franka ros2-positions ros2-trajectory] [--faults WORD ...]
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from tests.arms.faults import FAULTS, Outcome, suffer
from tests.arms.models import write_models
from tests.arms.positions import least_gap_m
from tests.arms.provide import meshes_of_fr3
from tests.arms.trial import PULLING, Kind, Trial

KINDS: Final[dict[str, Kind]] = {
    "franka": Kind("franka"),
    "ros2-positions": Kind("ros2", "positions"),
    "ros2-trajectory": Kind("ros2", "trajectory"),
}
BETWEEN_M: Final = "0.04"
"""Width of the object of the grasp, as that of the model's target"""


def approach(kind: Kind, folder: Path) -> dict[str, float]:
    """Pull R2 with 2 N until the arm stands; return least gap to the wall, loop age, and states a second."""
    wall = folder / "wall.xml"
    with Trial(kind, folder, wall) as trial:
        trial.begin_peer()
        trial.begin_driver()
        trial.drive(PULLING)
        began_s = time.monotonic()
        trial.wait_until("the arm stands", trial.rests)
        ages_ms = [one["loop_age_ms"] for one in trial.statuses("robot", began_s)]
        gap_m = least_gap_m(wall, trial.positions())
        speed = trial.fastest_rad_s()
    summary = json.loads(trial.summary.read_text())
    arm = summary["drivers"]["arm"]
    refused = sum(count for why, count in arm.items() if why != "accepted")
    figures = {"gap_mm": 1e3 * gap_m, "loop_age_ms": float(np.median(ages_ms)), "fastest_rad_s": speed}
    return figures | {"states_a_second": arm["accepted"] / summary["duration_s"], "refused": float(refused)}


def grasp(folder: Path) -> bool:
    """Let the scripted person grasp with the Franka hand; return whether the operator reads that it holds something."""
    with Trial(KINDS["franka"], folder, folder / "target.xml", BETWEEN_M) as trial:
        trial.begin_peer()
        trial.begin_driver()
        trial.drive(())
        trial.wait_until("held", lambda: trial.status("operator").get("holding"))
        return True


def row(name: str, outcome: Outcome) -> str:
    """Return a fault's row of the table."""
    stands = "–" if outcome.stands_after_s is None else f"{outcome.stands_after_s:.2f}"
    return f"| {name} | {stands} | {outcome.way_rad:.3f} | {outcome.reads} | {'yes' if outcome.back else 'NO'} |"


def main() -> int:
    """Print the tables; return 1 if an environment cannot be made."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", nargs="+", choices=KINDS, default=[*KINDS])
    parser.add_argument("--faults", nargs="*", help="only those whose name has one of these words")
    asked = parser.parse_args()
    out = sys.stdout
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        try:
            write_models(meshes_of_fr3(), folder)
        except pytest.skip.Exception as missing:
            out.write(f"{missing}\n")
            return 1
        for name in asked.peers:
            kind = KINDS[name]
            figures = ", ".join(f"{key} {value:.3g}" for key, value in approach(kind, folder).items())
            out.write(f"\n{name}: {figures}\n")
            if name == "franka":
                out.write(f"grasped: {grasp(folder)}\n")
            out.write("| fault | stands after, s | way after, rad | the operator reads | comes back |\n")
            with Trial(kind, folder, folder / "wall.xml") as trial:
                trial.begin_peer()
                trial.begin_driver()
                for fault in FAULTS:
                    wanted = asked.faults is None or any(word in fault.name for word in asked.faults)
                    if kind.peer in fault.peers and wanted:
                        out.write(row(fault.name, suffer(trial, fault)) + "\n")
                        out.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
