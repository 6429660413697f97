"""Drivers of docs/drivers with their real peers: judged by events and by the peers' own positions.

Bounds on time are generous: the machine may be busy. The figures are printed (`make test-arms`).
"""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.arms.faults import FAULTS, Fault, suffer
from tests.arms.models import JOINTS, write_models
from tests.arms.provide import meshes_of_fr3, provided
from tests.arms.table import KINDS, approach, grasp, row
from tests.arms.trial import DRIVERS, Trial
from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.repository import ROOT

pytestmark = [pytest.mark.arms, pytest.mark.processes]

STANDS_WITHIN_S = 1.5
"""The arm stands 0.1 to 0.3 s after a fault on an idle machine; one that goes on is seen for 3 s."""

FASTEST_RAD_S = 2.2
"""Above the 2 rad/s to which both drivers keep the joints"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("arms")
    write_models(meshes_of_fr3(), place)
    return place


@pytest.fixture(scope="module", params=["franka", "ros2-positions"])
def running(request: pytest.FixtureRequest, folder: Path) -> Iterator[Trial]:
    """A peer whose arm is driven up and down, and suffers one fault after the other."""
    kind = KINDS[request.param]
    provided(kind.peer)
    with Trial(kind, folder, folder / "wall.xml") as trial:
        trial.begin_peer()
        trial.begin_driver()
        yield trial


@pytest.mark.parametrize("name", KINDS)
def test_a_finger_of_2_n_is_stopped_before_the_wall(name: str, folder: Path) -> None:
    provided(KINDS[name].peer)
    figures = approach(KINDS[name], folder)
    print(name, {key: round(value, 3) for key, value in figures.items()})
    assert figures["gap_mm"] > 0.0
    assert 0.1 < figures["fastest_rad_s"] < FASTEST_RAD_S


def test_the_hand_grasps(folder: Path) -> None:
    provided("franka")
    assert grasp(folder)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_arm_stands_after_a_fault_and_comes_back(running: Trial, fault: Fault) -> None:
    if running.kind.peer not in fault.peers:
        pytest.skip(f"there is no such fault of {running.kind.peer}")
    outcome = suffer(running, fault)
    print(row(fault.name, outcome))
    if not fault.moves_on:
        assert outcome.stands_after_s is None or outcome.stands_after_s < STANDS_WITHIN_S
        assert outcome.reads != "armed"
        assert fault.reads in outcome.reads
    assert outcome.back


@pytest.mark.parametrize("name", ["franka", "ros2-positions"])
def test_another_number_of_joints_is_refused_by_name(name: str, folder: Path) -> None:
    kind = KINDS[name]
    provided(kind.peer)
    with Trial(kind, folder, None) as trial:  # the built-in arm has six joints
        trial.begin_peer()
        trial.begin_driver()
        driver = trial.driver
        assert driver is not None
        trial.wait_until("the driver is told", lambda: "refused:" in driver.heard())
        said = next(line for line in driver.heard().splitlines() if line.startswith("refused:"))
    print(said)
    assert "7" in said
    assert "6" in said


@pytest.mark.parametrize(
    ("kind", "topic"),
    [
        ("velocities", "/forward_velocity_controller/commands"),
        ("positions", "/forward_velocity_controller/commands"),
    ],
)
def test_a_controller_of_velocities_is_refused_in_one_line(kind: str, topic: str) -> None:
    words = [str(provided("ros2")), str(DRIVERS / "ros2_arm.py"), kind, topic, ",".join(JOINTS)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=LIMIT_S, cwd=ROOT, check=False)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "goes on if this process dies" in done.stderr
