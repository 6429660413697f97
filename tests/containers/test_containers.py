"""Both sides and the router in containers: each is killed or cut off, and comes back by itself, disarmed.

The tests run in the order of this file.
"""

import json
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from feelahead.containers.engine import Engine
from feelahead.containers.medium import PROJECT as TRIALS
from tests.containers.watch import Compose, Watched, link_up, state_is
from tests.helpers.machines.waiting import wait_until

pytestmark = [pytest.mark.containers, pytest.mark.processes]

SERVICES: Final = ("router", "robot", "operator")
DISTURBED: Final = re.compile(r"warning|traceback|error|exception|refused|denied|failed|cannot", re.IGNORECASE)
MOST_GAP_MS: Final = 1000.0
"""Limit, in milliseconds, of the gap in commands after which the arm stops.

100 ms are promised, and 120 at worst, but only a quiet machine keeps them.
"""


@pytest.fixture(scope="session")
def running(compose: Compose) -> Engine:
    """Engine on which all containers run, and a trigger has stiffened once."""
    began_s = time.monotonic()
    compose.engine.compose("up", "--detach", settings=compose.settings)
    operator = Watched(compose.engine, "operator")
    operator.wait_for("stiffened", lambda event: (event.get("R2_course_stiffness") or 0.0) > 0.0, 120.0)
    print(f"{time.monotonic() - began_s:.1f} s from `up` to the first stiffness (asked: 20 s)")
    return compose.engine


@pytest.mark.parametrize("service", SERVICES)
def test_little_is_left_open(running: Engine, service: str) -> None:
    """No port of the host is used, and a container has no more rights, programs and memory than promised."""
    known = running.inspect(running.container(service))
    host, ports = known["HostConfig"], known["NetworkSettings"]["Ports"] or {}
    assert not any(ports.values())
    assert [name.removeprefix("CAP_") for name in host["CapAdd"] or []] == ["NET_ADMIN"] * (service == "router")
    assert host["CapDrop"] == ["ALL"]
    assert host["ReadonlyRootfs"]
    # What the kernel cannot limit, the engine leaves out.
    known_limits = running.docker("info", "--format", "{{.MemoryLimit}} {{.PidsLimit}}").split()
    for can, name, most in zip(known_limits, ("Memory", "PidsLimit"), (4 << 30, 256), strict=True):
        assert can == "false" or 0 < host[name] <= most
    user = running.docker("exec", known["Id"], "id", "-u").strip()
    assert (user == "0") == (service == "router")
    assert not running.docker("exec", known["Id"], "sh", "-c", "command -v gcc cc g++ ld make || true").strip()


def test_the_health_checks_agree(running: Engine) -> None:
    def states() -> set[str]:
        return {running.inspect(running.container(name))["State"]["Health"]["Status"] for name in SERVICES}

    wait_until("healthy", lambda: states() == {"healthy"}, instead=states)


def test_no_log_tells_of_trouble_and_the_routers_tells_the_link(running: Engine) -> None:
    lines = running.compose("logs", "--no-color").splitlines()
    # Names of figures, such as `refused`, are no complaints.
    told = [re.sub(r'"[a-z_0-9]+": ?', "", line) for line in lines if "NO netem" not in line]
    assert [line for line in told if DISTURBED.search(line)] == []
    [how] = [line.split("feelahead-router: ", 1)[1] for line in lines if "netem" in line]
    print(how)


@pytest.mark.parametrize("service", ["operator", "router"])
def test_killed_the_arm_stops_and_comes_back_disarmed(running: Engine, service: str) -> None:
    disturbed_and_back(running, Watched(running, service).kill)


def test_the_robot_side_killed(running: Engine) -> None:
    """The triggers are released. The robot side comes back disarmed, and follows no command from before."""
    robot, operator = Watched(running, "robot"), Watched(running, "operator")
    armed(robot)
    operator.new_events()
    robot.kill()
    operator.wait_for("without a link", lambda event: event.get("event") == "status" and event.get("link") != "up")
    heard = operator.wait_for("link up", link_up)
    without = [event for event in heard if event.get("event") == "status" and event.get("link") != "up"]
    assert not any(event["R2_course_stiffness"] for event in without)
    robot.wait_for("started again", lambda event: event.get("event") == "listening")
    came_back_disarmed(robot)


def test_sigterm_ends_both_sides_well(running: Engine) -> None:
    containers = {service: running.container(service) for service in ("operator", "robot")}
    running.docker("stop", "--time", "5", *containers.values())
    assert [running.inspect(one)["State"]["ExitCode"] for one in containers.values()] == [0, 0]
    assert running.read_json(containers["robot"], "/results/robot.json")["ticks"] > 0


def test_a_trial_of_the_latency_experiment(compose: Compose, tmp_path: Path) -> None:
    """A trial has the sides talk in virtual time and in containers, and leaves no container behind."""
    words = [
        "--links",
        "lan",
        "--haptics",
        "off",
        "--seeds",
        "1",
        "--duration",
        "20",
        "--media",
        "virtual",
        "--compose",
    ]
    # Trials of others, and remains of older ones, are not judged here.
    before = compose.existing(f"name={TRIALS}")
    summary = tmp_path / "latency.json"
    command = [sys.executable, "-P", "-m", "feelahead", "try", "latency", *words, f"--summary={summary}"]
    environment = {**compose.engine.environment, **compose.settings}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    trials = {trial["medium"]: trial for trial in json.loads(summary.read_text())["runs"]}
    assert set(trials) == {"virtual", "containers"}
    for trial in trials.values():
        assert min(trial["to_robot_samples"], trial["to_operator_samples"]) > 0
    assert trials["virtual"]["contact_speed_mm_s"] is not None
    # In real time a busy machine may hold up commands, so that the arm stops or is never armed: this is only told.
    in_containers = trials["containers"]
    print({name: in_containers[name] for name in ("contact_speed_mm_s", "min_distance_mm", "stops")})
    assert compose.existing(f"name={TRIALS}") <= before


def disturbed_and_back(engine: Engine, disturb: Callable[[], None]) -> None:
    """Disturb an armed run; assert that the arm stops in time and that the scripted person arms it again."""
    robot = Watched(engine, "robot")
    armed(robot)
    robot.new_events()
    disturb()
    *_, stop = robot.wait_for("disarmed", state_is("disarmed", "ready"))
    gap = re.fullmatch(r"no command for (\d+) ms", stop.get("stopped_because") or "")
    assert gap is None or float(gap[1]) <= MOST_GAP_MS
    came_back_disarmed(robot)


def armed(robot: Watched) -> None:
    robot.new_events()
    robot.wait_for("armed", state_is("armed"), 120.0)


def came_back_disarmed(robot: Watched) -> None:
    """Wait until the arm is armed; assert that the status just before was disarmed, with a link."""
    heard = [event for event in robot.wait_for("armed", state_is("armed"), 120.0) if event.get("event") == "status"]
    # Five statuses fit into the healthy second that arming needs.
    assert any(link_up(event) and state_is("disarmed", "ready")(event) for event in heard[-2:-1])
