"""LeRobot 0.6.1 itself on an emulated bus, driven by both sides: make test-lerobot."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.helpers.machines.waiting import LIMIT_S
from tests.lerobot.rig import DRIVERS, ENVIRONMENT, Rig, missing
from tests.lerobot.servo_bus import CENTRE, STEP_RAD, STEPS
from tests.lerobot.so101 import JAW_RAD, NAMES
from tests.lerobot.table import LOOPS
from tests.lerobot.trials import Outcome, approach, dead, deaf, fault, killed, stopped, unplugged

pytestmark = [
    pytest.mark.lerobot,
    pytest.mark.processes,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

ONE_STEP = 0.1
"""A little more than one step of a servo: 0.088° of a joint, 0.080 of the jaw's 100"""

READ_DATASET = """
import json, sys
from lerobot.datasets import LeRobotDataset
dataset = LeRobotDataset("nobody/emulated", root=sys.argv[1])
frames = [dataset[number] for number in range(len(dataset))]
columns = {name: [frame[name].tolist() for frame in frames] for name in ("action", "observation.state", "timestamp")}
names = {name: dataset.features[name]["names"] for name in ("action", "observation.state")}
print(json.dumps({"episodes": dataset.num_episodes, "names": names, "fps": dataset.fps} | columns))
"""


@pytest.mark.parametrize("driver", DRIVERS)
def test_two_newtons_stop_before_the_wall(driver: str, tmp_path: Path) -> None:
    came = approach(driver, tmp_path)
    assert 0.002 < came.left_m < 0.5 * came.began_m, came
    if driver == "lerobot-record":
        reads = [str(ENVIRONMENT / "bin" / "python"), "-c", READ_DATASET, str(tmp_path / "dataset")]
        said = subprocess.run(reads, capture_output=True, text=True, timeout=LIMIT_S, check=True).stdout
        the_dataset_is_what_was_commanded(json.loads(said.splitlines()[-1]), came.commanded)


def the_dataset_is_what_was_commanded(found: dict[str, Any], commanded: list[list[int]]) -> None:
    """Compare an episode with the goals that the servos got, in steps: of 360°, and of the jaw's range of 0 to 100."""
    assert found["episodes"] == 1
    assert found["names"] == {key: [f"{name}.pos" for name in NAMES] for key in ("action", "observation.state")}
    actions, states = np.array(found["action"]), np.array(found["observation.state"])
    goals = np.array(commanded, dtype=float)
    print(f"{len(actions)} frames of {found['fps']} a second, {len(goals)} goals written")
    assert len(actions) == len(goals) > 10
    shut, wide = (round(CENTRE + angle / STEP_RAD) for angle in JAW_RAD)
    goals[:, :-1] = (goals[:, :-1] - CENTRE) * 360.0 / (STEPS - 1)
    goals[:, -1] = 100.0 * (goals[:, -1] - shut) / (wide - shut)
    assert np.abs(actions - goals).max() < ONE_STEP
    assert np.ptp(actions, axis=0).max() > 1.0, "no goal moved in the episode"
    assert np.abs(states[-1] - actions[-1]).max() < 1.0, "the arm stands at its last goal"


def struck(driver: str, folder: Path, strike: Callable[[Rig], None]) -> Outcome:
    """Return what a fault came to, after checks that hold for all."""
    got = fault(driver, folder, strike)
    assert got.stood_s < 1.0, got
    assert any(line.startswith(("disarmed", "stopped")) for line in got.read), got
    return got


@pytest.mark.parametrize("driver", LOOPS)
@pytest.mark.parametrize("strike", [killed, stopped])
def test_the_servos_stand_when_lerobot_is_killed_or_stopped(
    driver: str, strike: Callable[[Rig], None], tmp_path: Path
) -> None:
    assert struck(driver, tmp_path, strike).moves_again


def test_the_driver_survives_a_bus_that_is_dead_for_a_while(tmp_path: Path) -> None:
    got = struck(LOOPS[0], tmp_path, deaf)
    assert got.ended is None
    assert got.moves_again


@pytest.mark.parametrize("strike", [dead, unplugged])
def test_the_driver_ends_with_one_line_when_the_bus_is_dead_for_good(
    strike: Callable[[Rig], None], tmp_path: Path
) -> None:
    got = struck(LOOPS[0], tmp_path, strike)
    assert got.ended == 1
    assert got.said.startswith("servo bus: ")
    assert "check its power and its plugs" in got.said


def test_a_bus_that_is_dead_for_a_while_ends_the_loop_of_lerobot(tmp_path: Path) -> None:
    got = struck(LOOPS[1], tmp_path, deaf)
    assert got.ended == 1
    assert got.moves_again


def test_another_program_of_lerobot_gets_one_line() -> None:
    asks = "import lerobot_teleoperator_feelahead as it; it.FeelaheadTeleop(it.FeelaheadTeleopConfig())"
    ended = subprocess.run(
        [str(ENVIRONMENT / "bin" / "python"), "-c", asks], capture_output=True, text=True, timeout=LIMIT_S, check=False
    )
    assert ended.returncode == 2
    assert ended.stderr.splitlines()[-1] == (
        "feelahead: program = another one; valid: lerobot-teleoperate or lerobot-record"
    )
