"""`feelahead doctor --connect` where packets get lost: network namespaces with routes and firewalls of their own."""

import contextlib
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest

from tests.helpers.machines.two_machines import two_machines
from tests.helpers.repository import ROOT

pytestmark = pytest.mark.processes

LIMIT_S = 600.0
ROBOT, OPERATOR = "10.91.83.1", "10.91.83.2"
CONTROL = f"tcp://{ROBOT}:5555"
FIREWALL = """
add table inet doctor
add chain inet doctor entrance {{ type filter hook input priority 0 ; }}
add rule inet doctor entrance {rule}
"""


@dataclass
class Desk:
    """A robot's machine and an operator's, with one wire between them and no other."""

    robot: list[str]
    operator: list[str]

    def run(self, where: list[str], *program: str, text: str = "") -> None:
        subprocess.run([*where, *program], check=True, capture_output=True, text=True, input=text, timeout=LIMIT_S)

    def block(self, rule: str) -> None:
        """A rule of the firewall on the robot's machine."""
        if shutil.which("nft") is None:
            pytest.skip("a firewall needs nft (apt install nftables)")
        try:
            self.run(self.robot, "nft", "-f", "-", text=FIREWALL.format(rule=rule))
        except subprocess.CalledProcessError as error:
            pytest.skip(f"nft: {error.stderr.strip()}")

    @contextlib.contextmanager
    def serving(self) -> Iterator[None]:
        """A robot side on the robot's machine."""
        program = [*self.robot, sys.executable, "-m", "tests.helpers.serving_robot", CONTROL]
        with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == CONTROL
            try:
                yield
            finally:
                process.communicate(timeout=LIMIT_S)

    def doctor(self, connect: str = CONTROL) -> dict[str, Any]:
        """Run the doctor on the operator's machine."""
        program = [*self.operator, sys.executable, "-m", "feelahead", "doctor", "--json", "--connect", connect]
        done = subprocess.run(program, check=False, capture_output=True, text=True, cwd=ROOT, timeout=LIMIT_S)
        told: dict[str, Any] = json.loads(done.stdout)
        assert done.returncode == (0 if told["reached"] else 1), done.stderr
        return told


@pytest.fixture
def desk() -> Iterator[Desk]:
    with two_machines(ROBOT, OPERATOR) as (robot, operator):
        yield Desk(robot.surroundings, operator.surroundings)


@pytest.mark.parametrize(
    ("address", "route", "said"),
    [
        ("10.91.84.1", False, "Network is unreachable"),
        ("10.91.84.1", True, "No route to host"),
        ("10.91.83.77", False, "no machine on its network has that address"),
    ],
    ids=["no network", "unreachable", "nobody's address"],
)
def test_no_way_there(desk: Desk, address: str, route: bool, said: str) -> None:
    if route:
        desk.run(desk.operator, "ip", "route", "add", "unreachable", "10.91.84.0/24")
    told = desk.doctor(f"tcp://{address}:5555")
    assert told["wrong"] == "route"
    assert said in told["said"]


def test_nothing_listens(desk: Desk) -> None:
    told = desk.doctor()
    assert told["wrong"] == "closed port"
    assert "--bind tcp://0.0.0.0:5555" in told["remedy"]


@pytest.mark.parametrize(
    ("rule", "wrong"),
    [
        ("tcp dport 5555 drop", "firewall"),
        ("tcp dport 5556 drop", "view port"),
        ("tcp dport 5555 ip length > 1000 drop", "large packets"),
    ],
)
def test_a_firewall(desk: Desk, rule: str, wrong: str) -> None:
    desk.block(rule)
    with desk.serving():
        assert desk.doctor()["wrong"] == wrong


def test_all_is_well(desk: Desk) -> None:
    with desk.serving():
        told = desk.doctor()
    assert (told["reached"], told["arm"]) == (True, "free")
    assert told["round_trips"] > 0
