"""What is tried on the running containers, each with a line about what was seen."""

import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from feelahead.containers.engine import Engine
from feelahead.containers.medium import PROJECT as TRIALS
from tests.containers.watch import Watched, check, link_up, state_is

SERVICES: Final = ("router", "robot", "operator")
_DISTURBED: Final = re.compile(r"warning|traceback|error|exception|refused|denied|failed|cannot", re.IGNORECASE)
_MOST_GAP_MS: Final = 1000.0
"""100 ms are promised, and 20 more in the worst case; only a quiet machine can be held to that."""


def first_stiffness(engine: Engine, settings: Mapping[str, str]) -> str:
    """From nothing but images to a stiffened trigger."""
    began_s = time.monotonic()
    engine.compose("up", "--detach", settings=settings)
    operator = Watched(engine, "operator")
    operator.wait_for("stiffened", lambda event: (event.get("R2") or 0.0) > 0.0, 120.0)
    return f"{time.monotonic() - began_s:.1f} s from `up` to the first stiffness (asked: 20 s)"


def closed(engine: Engine, _: Mapping[str, str]) -> str:
    """Nothing listens on the host; users, rights and programs are as few as promised."""
    for service in SERVICES:
        known = engine.inspect(engine.container(service))
        host, ports = known["HostConfig"], known["NetworkSettings"]["Ports"] or {}
        check(not any(ports.values()), f"{service} listens on the host: {ports}")
        added = [name.removeprefix("CAP_") for name in host["CapAdd"] or []]
        check(not added or service == "router", f"{service} may: {added}")
        check(set(added) <= {"NET_ADMIN", "NET_RAW", "SYS_NICE"}, f"{service} may: {added}")
        check(host["CapDrop"] == ["ALL"], f"{service} keeps rights: {host['CapDrop']}")
        check(host["ReadonlyRootfs"], f"{service} can write to its own files")
        user = engine.docker("exec", known["Id"], "id", "-u").strip()
        check((user == "0") == (service == "router"), f"{service} runs as {user}")
        found = engine.docker("exec", known["Id"], "sh", "-c", "command -v gcc cc g++ ld make || true").strip()
        check(not found, f"{service} has a compiler: {found}")
    return "no port on the host, sides without root and rights, no compiler"


def healthy(engine: Engine, _: Mapping[str, str]) -> str:
    """The health checks agree."""
    end_s = time.monotonic() + 60.0
    while True:
        states = {name: engine.inspect(engine.container(name))["State"]["Health"]["Status"] for name in SERVICES}
        if set(states.values()) == {"healthy"}:
            return "router, robot and operator healthy"
        check(time.monotonic() < end_s, f"health: {states}")
        time.sleep(1.0)


def quiet_logs(engine: Engine, _: Mapping[str, str]) -> str:
    """No line of any container's log tells of trouble."""
    lines = engine.compose("logs", "--no-color").splitlines()
    bad = [line for line in lines if _DISTURBED.search(_without_figures(line)) and "NO netem" not in line]
    check(not bad, f"{len(bad)} of {len(lines)} lines: {bad[:3]}")
    how = next((line.split("feelahead-router: ", 1)[1] for line in lines if "netem" in line), "")
    return f"{len(lines)} lines without a warning; link: {how[:90]}"


def operator_killed(engine: Engine, _: Mapping[str, str]) -> str:
    """kill -9: the arm stops by itself, and the operator side comes back disarmed."""
    return _disturbed_and_back(engine, Watched(engine, "operator").kill)


def router_killed(engine: Engine, _: Mapping[str, str]) -> str:
    """kill -9 of the router: the cable is gone, and comes back."""
    return _disturbed_and_back(engine, Watched(engine, "router").kill)


def network_taken(engine: Engine, _: Mapping[str, str]) -> str:
    """The router is taken out of the operator's network, and put back: another address, another interface."""
    network, router = f"{engine.project}_operator", engine.container("router")

    def take() -> None:
        engine.docker("network", "disconnect", "--force", network, router)
        time.sleep(1.0)
        engine.docker("network", "connect", "--alias", "robot", network, router)

    return _disturbed_and_back(engine, take)


def robot_killed(engine: Engine, _: Mapping[str, str]) -> str:
    """kill -9: the triggers are released, and the robot side comes back disarmed, with none of the old commands."""
    robot, operator = Watched(engine, "robot"), Watched(engine, "operator")
    _armed(robot)
    operator.new_events()
    robot.kill()
    operator.wait_for("without a link", lambda event: event.get("event") == "status" and event.get("link") != "up")
    heard = operator.wait_for("link up", link_up)
    stiff = [event["R2"] for event in heard if event.get("event") == "status" and event.get("link") != "up"]
    check(not any(stiff), f"R2 stiff without a link: {stiff}")
    began_s = time.monotonic()
    robot.wait_for("started anew", lambda event: event.get("event") == "listening")
    _came_back_disarmed(robot)
    return (
        f"triggers free while it was away; disarmed, then armed by the person {time.monotonic() - began_s:.0f} s later"
    )


def ended(engine: Engine, _: Mapping[str, str]) -> str:
    """SIGTERM ends both sides well, with summaries."""
    containers = {service: engine.container(service) for service in ("operator", "robot")}
    engine.docker("stop", "--time", "5", *containers.values())
    for service, container in containers.items():
        code = engine.inspect(container)["State"]["ExitCode"]
        check(code == 0, f"{service} ended with code {code}")
    summary = engine.read_json(containers["robot"], "/results/robot.json")
    stops = [stop["reason"] for stop in summary["stops"]]
    return f"codes 0, summaries written; the last robot process ticked {summary['ticks']} times, stops: {stops}"


def one_trial(engine: Engine, settings: Mapping[str, str]) -> str:
    """The latency experiment, as short as it can be: both media know of one contact, and leave nothing either."""
    words = ["--links", "lan", "--haptics", "off", "--seeds", "1", "--duration", "4", "--media", "virtual", "--compose"]
    # Others' trials, and what older ones left, are not ours to judge.
    before = _existing(engine, f"name={TRIALS}")
    with tempfile.TemporaryDirectory(prefix="feelahead-containers-") as folder:
        command = [sys.executable, "-P", "-m", "feelahead", "try", "latency", *words, "--out", folder]
        environment = {**engine.environment, **settings}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300, check=False)
        check(done.returncode == 0, f"try latency: {done.stderr.strip().splitlines()[-1:]}")
        trials = json.loads((Path(folder) / "latency.json").read_text())["trials"]
    speeds = {trial["medium"]: trial["contact_speed_mm_s"] for trial in trials}
    check(set(speeds) == {"virtual", "containers"}, f"media: {speeds}")
    check(None not in speeds.values(), f"no contact without haptics: {speeds}")
    left = _existing(engine, f"name={TRIALS}") - before
    check(not left, f"left by the trial: {sorted(left)}")
    return ", ".join(f"{medium}: contact at {speed:.0f} mm/s" for medium, speed in speeds.items())


def nothing_left(engine: Engine, _: Mapping[str, str]) -> str:
    """`down --volumes` leaves neither containers nor networks nor volumes."""
    engine.remove()
    left = _existing(engine, f"label=com.docker.compose.project={engine.project}")
    check(not left, f"left: {sorted(left)}")
    return "no container, no network, no volume"


def _existing(engine: Engine, which: str) -> set[str]:
    """The containers, networks and volumes that a filter of the engine lets through."""
    kinds = (("ps", "--all"), ("network", "ls"), ("volume", "ls"))
    return {one for kind in kinds for one in engine.docker(*kind, "--quiet", "--filter", which).split()}


def _disturbed_and_back(engine: Engine, disturb: Callable[[], None]) -> str:
    robot = Watched(engine, "robot")
    _armed(robot)
    robot.new_events()
    disturb()
    *_, stop = robot.wait_for("disarmed", state_is("disarmed", "ready"))
    because = stop.get("stopped_because") or "its owner is away"
    gap = re.fullmatch(r"no command for (\d+) ms", because)
    check(gap is None or float(gap[1]) <= _MOST_GAP_MS, f"stopped too late: {because}")
    began_s = time.monotonic()
    _came_back_disarmed(robot)
    return f"stopped: {because}; disarmed, then armed by the person {time.monotonic() - began_s:.0f} s later"


def _armed(robot: Watched) -> None:
    robot.new_events()
    robot.wait_for("armed", state_is("armed"), 120.0)


def _came_back_disarmed(robot: Watched) -> None:
    """After a stop or a start: armed only after it was seen disarmed once more, and with a link."""
    heard = [event for event in robot.wait_for("armed", state_is("armed"), 120.0) if event.get("event") == "status"]
    # Five statuses fit into the healthy second that arming asks for.
    disarmed = any(link_up(event) and state_is("disarmed", "ready")(event) for event in heard[-2:-1])
    check(disarmed, f"armed at once: {[(event['link'], event['state']) for event in heard]}")


def _without_figures(line: str) -> str:
    """A line of a log without the names of figures, such as `refused`, which count and do not complain."""
    return re.sub(r'"[a-z_0-9]+": ', "", line)


CHECKS: Final[tuple[Callable[[Engine, Mapping[str, str]], str], ...]] = (
    first_stiffness,
    closed,
    healthy,
    quiet_logs,
    operator_killed,
    robot_killed,
    router_killed,
    network_taken,
    ended,
    one_trial,
    nothing_left,
)
