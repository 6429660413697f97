"""Who else comes, and sides that die, start in the other order, or have their wall clock set."""

import json
import time
from dataclasses import replace
from pathlib import Path

from tests.kernel.waiting import require
from tests.two_hosts.lan import Host, Lan, is_armed
from tests.two_hosts.network_rows import ATTEMPTS, NotJudgedError, gap_ms

_AN_HOUR_S = 3600
_REFUSED = "does not let this key in"


def second_operator(lan: Lan) -> str:
    """One with an allowed key watches, until the key is revoked; one with an unknown key gets nothing."""
    bob, eve = lan.operator_host.user("bob"), lan.operator_host.user("eve")
    for one in (bob, eve):
        one.run("feelahead keys make operator")
    lan.robot_host.run(f"feelahead keys allow bob {bob.run('feelahead keys show operator').strip()}")
    lan.moving()
    # The same person as at the other controller: they try to arm and to drive.
    bobs = lan.start("operator", bob, called="bob")
    lan.until("bob", "watching", lambda status: str(status["link"]).startswith("observing"))
    lan.until("robot", "an observer", lambda status: status["observers"] == 1)
    lan.until("operator", "armed", is_armed)
    for _ in lan.watch(1.5):
        require(str(bobs.status["link"]).startswith("observing"), f"bob did not stay an observer: {bobs.status}")
    lan.robot_host.run("feelahead keys revoke bob")
    began_s = time.monotonic()
    lan.until("bob", "out", lambda status: _REFUSED in str(status["link"]))
    lan.until("robot", "no observer", lambda status: status["observers"] == 0)
    out_s = time.monotonic() - began_s
    lan.end("bob")
    summary = eve.home / "summary.json"
    eves = lan.start("operator", eve, f"--summary={summary}", called="eve")
    lan.until("eve", "refused", lambda status: _REFUSED in str(status["link"]))
    lan.end("eve")
    received = json.loads(summary.read_text(encoding="utf-8"))["messages"]["stiffness_received"]
    watched = any("target" in status for status in eves.said)
    require(received == 0 and not watched, f"eve received {received} messages; telemetry: {watched}")
    lan.until("robot", "anna's link", lambda status: status["link"] == "up")
    return f"bob watched, and was out {out_s:.1f} s after the revocation; eve received {received} messages"


def revoked_while_driving(lan: Lan) -> str:
    """Whoever drives is out, too, and comes back once they are allowed again."""
    lan.moving()
    lan.robot_host.run("feelahead keys revoke anna")
    began_s = time.monotonic()
    lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
    stopped_s = time.monotonic() - began_s
    lan.until("operator", "out", lambda status: _REFUSED in str(status["link"]))
    lan.until("operator", "the triggers are free", lambda status: status["triggers_released"] is True)
    lan.robot_host.run(f"feelahead keys allow anna {lan.words['OPERATOR-KEY']}")
    return f"stopped {stopped_s:.1f} s after the command; back {lan.back():.1f} s after being allowed again"


def robot_killed(lan: Lan) -> str:
    """Kill -9, and started again."""
    lan.moving()
    lan.kill("robot")
    lan.until("operator", "the triggers are free", lambda status: status["triggers_released"] is True)
    lan.until("operator", "the link is lost", lambda status: str(status["link"]).startswith("lost"))
    lan.start("robot")
    lan.until("robot", "it listens", bool)
    return f"triggers free; back {lan.back():.1f} s after it listened again, disarmed"


def operator_killed(lan: Lan) -> str:
    """Kill -9, and started again."""
    lan.moving()
    lan.kill("operator")
    stop = lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
    lan.until("robot", "the lease is free", lambda status: status["owner"] == "none")
    lan.start("operator")
    return f"stopped after {gap_ms(stop):.0f} ms; up {lan.back():.1f} s after its start, disarmed"


def operator_first(lan: Lan) -> str:
    """The operator side is there before the robot side is."""
    for side in ("operator", "robot"):
        lan.end(side)
    lan.start("operator")
    lan.until("operator", "it waits", lambda status: status["link"] == "waiting for the robot side")
    lan.start("robot")
    lan.until("robot", "it listens", bool)
    return f"up {lan.back():.1f} s after the robot side listened, disarmed until armed"


def wall_clock(lan: Lan) -> str:
    """An hour forward and back again, for the two processes alone, while the arm moves."""
    libraries = sorted(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"))
    if not libraries:
        raise NotJudgedError("no libfaketime here (apt install libfaketime)")
    offset = lan.robot_host.home.with_name("wall-clock")
    faked = {
        "LD_PRELOAD": str(libraries[0]),
        "FAKETIME_TIMESTAMP_FILE": str(offset),
        "FAKETIME_NO_CACHE": "1",
        "DONT_FAKE_MONOTONIC": "1",
    }

    def under_it(host: Host) -> Host:
        return replace(host, also=faked)

    def step(offset_s: int) -> int:
        """Set it; what a program there takes for the time."""
        partial = offset.with_suffix(".new")
        partial.write_text(f"+{offset_s}\n", encoding="ascii")
        partial.replace(offset)
        return int(under_it(lan.robot_host).run("date +%s"))

    step(0)
    lan.restart(under_it)
    why = None
    for _ in range(ATTEMPTS):
        lan.moving()
        before_s = step(0)
        stepped_s = step(_AN_HOUR_S) - before_s
        armed = all(is_armed(lan.robot.status) for _ in lan.watch(1.5))
        why = lan.robot.status["stopped_because"]
        step(0)
        if armed and all(is_armed(lan.robot.status) for _ in lan.watch(1.5)):
            break
        armed, why = False, why or lan.robot.status["stopped_because"]
    require(_AN_HOUR_S <= stepped_s < _AN_HOUR_S + 60, f"the clock was stepped by {stepped_s} s")
    require(armed, f"the arm was stopped each time: {why}")
    lan.restart()
    return f"stepped by {stepped_s} s and back: 0 trips"
