"""LeRobot 0.6.1 itself on an emulated bus, driven by both sides: make test-lerobot."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.helpers.machines.waiting import LIMIT_S
from tests.lerobot.rig import DRIVERS, ENVIRONMENT, Rig, missing
from tests.lerobot.table import LOOPS
from tests.lerobot.trials import Outcome, approach, dead, deaf, fault, killed, stopped, unplugged

pytestmark = [
    pytest.mark.lerobot,
    pytest.mark.processes,
    pytest.mark.skipif(missing() is not None, reason=str(missing())),
]

READ_DATASET = """
import sys
from lerobot.datasets import LeRobotDataset
dataset = LeRobotDataset("nobody/emulated", root=sys.argv[1])
first, last = dataset[0]["action"], dataset[len(dataset) - 1]["action"]
print(dataset.num_episodes, len(dataset), float((last - first).abs().max()))
"""


@pytest.mark.parametrize("driver", DRIVERS)
def test_two_newtons_stop_before_the_wall(driver: str, tmp_path: Path) -> None:
    came = approach(driver, tmp_path)
    assert 0.002 < came.left_m < 0.5 * came.began_m, came
    if driver == "lerobot-record":
        reads = [str(ENVIRONMENT / "bin" / "python"), "-c", READ_DATASET, str(tmp_path / "dataset")]
        said = subprocess.run(reads, capture_output=True, text=True, timeout=LIMIT_S, check=True).stdout.split()
        assert int(said[0]) == 1
        assert int(said[1]) > 10
        assert float(said[2]) > 1.0, "no goal moved in the episode"


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
