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

from feelahead.lab.faults.two_machines import NotPermittedError, two_machines
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
        """What the doctor says on the operator's machine."""
        program = [*self.operator, sys.executable, "-m", "feelahead", "doctor", "--json", "--connect", connect]
        done = subprocess.run(program, check=False, capture_output=True, text=True, cwd=ROOT, timeout=LIMIT_S)
        told: dict[str, Any] = json.loads(done.stdout)
        assert done.returncode == (0 if told["reached"] else 1), done.stderr
        return told


@pytest.fixture
def desk() -> Iterator[Desk]:
    with contextlib.ExitStack() as stack:
        try:
            robot, operator = stack.enter_context(two_machines(ROBOT, OPERATOR))
        except NotPermittedError as error:
            pytest.skip(str(error))
        yield Desk(robot.surroundings, operator.surroundings)


def test_no_network_there(desk: Desk) -> None:
    told = desk.doctor("tcp://10.91.84.1:5555")
    assert told["wrong"] == "route"
    assert "Network is unreachable" in told["said"]


def test_a_way_that_is_known_to_lead_nowhere(desk: Desk) -> None:
    desk.run(desk.operator, "ip", "route", "add", "unreachable", "10.91.84.0/24")
    told = desk.doctor("tcp://10.91.84.1:5555")
    assert told["wrong"] == "route"
    assert "No route to host" in told["said"]


def test_an_address_that_no_machine_has(desk: Desk) -> None:
    told = desk.doctor("tcp://10.91.83.77:5555")
    assert told["wrong"] == "route"
    assert "no machine on its network has that address" in told["said"]


def test_nothing_listens(desk: Desk) -> None:
    told = desk.doctor()
    assert told["wrong"] == "closed port"
    assert "--bind tcp://0.0.0.0:5555" in told["remedy"]


def test_a_firewall_that_drops(desk: Desk) -> None:
    desk.block("tcp dport 5555 drop")
    assert desk.doctor()["wrong"] == "firewall"


def test_a_firewall_that_drops_what_goes_to_the_view_port_alone(desk: Desk) -> None:
    desk.block("tcp dport 5556 drop")
    with desk.serving():
        told = desk.doctor()
    assert told["wrong"] == "view port"
    assert f"{ROBOT}:5556 gave no answer" in told["said"]
    assert "any to any port 5555,5556" in told["remedy"]


def test_large_packets_that_are_swallowed(desk: Desk) -> None:
    desk.block("tcp dport 5555 ip length > 1000 drop")
    with desk.serving():
        assert desk.doctor()["wrong"] == "large packets"


def test_all_is_well(desk: Desk) -> None:
    with desk.serving():
        told = desk.doctor()
    assert (told["reached"], told["arm"]) == (True, "free")
    assert told["round_trips"] > 0
