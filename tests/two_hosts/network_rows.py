"""What a network does to a link: cables, addresses, firewalls, small packets, name servers."""

import re
import shutil
import time
from collections.abc import Callable

from tests.kernel.waiting import CheckError, require
from tests.two_hosts.following import follow
from tests.two_hosts.lan import Lan, Status, is_armed

_MOST_GAP_MS = 1000.0
"""100 ms are promised, and 20 more in the worst case; only a quiet machine can be held to that."""
_MOST_SEGMENT = 536
"""Bytes: 576 without the headers of IP and TCP."""
_STILL_MM = 2.0
_SETTLES_S = 0.5
ATTEMPTS = 3


class NotJudgedError(Exception):
    """A row that this machine cannot try; the text says what is missing."""


def as_the_guide_says(lan: Lan) -> str:
    """Keys, firewall and starts by the guide's own lines."""
    notes = follow(lan)
    lan.start("robot")
    lan.until("robot", "it listens", bool)
    lan.start("operator")
    lan.until("operator", "the link is up", lambda status: status["link"] == "up")
    lan.until("operator", "armed", is_armed)
    _all_flows(lan)
    lan.ask_doctor(0, "somebody has the arm")
    delay_ms = lan.operator.status["delay_ms"]
    clocks = "clocks 28 h apart" if lan.own_clocks else "one clock: no time namespaces here"
    return f"armed; delay {delay_ms:.1f} ms, {clocks}; {'; '.join(notes)}"


def cable_pulled(lan: Lan) -> str:
    """For a second, and for longer than any connection lives."""
    told = []
    for pause_s in (1.0, 6.0):
        lan.moving()
        lan.robot_host.machine.unplug()
        after_ms, moved_mm = _stopped(lan, pause_s)
        lan.ask_doctor(1, "route")
        lan.robot_host.machine.plug_in()
        back_s = lan.back()
        told.append(f"{after_ms:.0f} ms, then {moved_mm:.1f} mm in {pause_s:g} s; back in {back_s:.1f} s")
    return f"triggers free; stopped after {' | '.join(told)}"


def operators_address(lan: Lan) -> str:
    """Another address for the operator's machine."""
    return _interrupted(lan, lambda: lan.operator_host.machine.readdress("198.18.0.3"))


def robots_address(lan: Lan) -> str:
    """Another address for the robot's machine, which the operator's knows by name."""

    def move() -> None:
        lan.robot_host.machine.readdress("198.18.0.4")
        lan.tell_name("198.18.0.4")

    return _interrupted(lan, move)


def swallowed(lan: Lan) -> str:
    """Nothing answers, not even that there is nobody: attempts to connect are made anew all the same."""
    if shutil.which("nft") is None:
        raise NotJudgedError("no nft here (apt install nftables)")
    lan.moving()
    lan.swallow(True)
    after_ms, moved_mm = _stopped(lan, 12.0)
    lan.swallow(False)
    return f"stopped after {after_ms:.0f} ms, then {moved_mm:.1f} mm in 12 s; back in {lan.back():.1f} s"


def small_packets(lan: Lan) -> str:
    """The largest packet is 576 bytes at both ends: for what is connected already, and for new handshakes."""
    hosts = (lan.robot_host, lan.operator_host)
    for host in hosts:
        host.machine.set_link("mtu", "576")
    _all_flows(lan)
    lan.end("operator")
    lan.start("operator")
    lan.moving()
    _all_flows(lan)
    segment = re.search(r"\bmss:(\d+)", lan.operator_host.run("ss -tin state established '( dport = :5555 )'"))
    for host in hosts:
        host.machine.set_link("mtu", "1500")
    if segment is None:
        raise CheckError("ss tells no segment size of the operator's connection")
    require(int(segment[1]) <= _MOST_SEGMENT, f"segments of {segment[1]} bytes, which are more than {_MOST_SEGMENT}")
    return f"armed, stiffness and telemetry flow; segments of {segment[1]} bytes"


def silent_name_server(lan: Lan) -> str:
    """The name is known no more and nobody answers who would: views connect anew after a revocation, control runs on.

    Then both sides end in good time, one of them in the middle of asking.
    """
    key, why = lan.words["OPERATOR-KEY"][:-4], None
    for attempt in range(ATTEMPTS):
        lan.robot_host.run(f"feelahead keys allow carol{attempt} {key}{attempt:04d}")
        lan.moving()
        lan.tell_name(None)
        lan.robot_host.run(f"feelahead keys revoke carol{attempt}")
        armed = all(is_armed(lan.robot.status) for _ in lan.watch(2.0))
        if armed:
            break
        why = lan.robot.status["stopped_because"]
        lan.tell_name(lan.robot_host.machine.address)
        lan.back()
    require(armed, f"the arm was stopped each time: {why}")
    lan.end("robot")
    lan.until("operator", "the link is lost", lambda status: status["link"] != "up")
    took_s = lan.end("operator")
    lan.tell_name(lan.robot_host.machine.address)
    lan.restart()
    return f"armed throughout; ended in {took_s:.1f} s while asking"


def _interrupted(lan: Lan, cause: Callable[[], None]) -> str:
    lan.moving()
    began_s = time.monotonic()
    cause()
    stop = lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
    lan.until("operator", "the link is lost", lambda status: status["link"] != "up")
    lan.back()
    return f"stopped after {gap_ms(stop):.0f} ms; armed anew {time.monotonic() - began_s:.1f} s after the change"


def _stopped(lan: Lan, for_s: float) -> tuple[float, float]:
    """Wait until the arm is stopped and the triggers are free, and see it stand: after which gap, how far it moved."""
    stop = lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
    lan.until("operator", "the triggers are free", lambda status: status["triggers_released"] is True)
    lan.until("operator", "it is blind", lambda status: status["feel"] == "blind")
    for _ in lan.watch(_SETTLES_S):
        pass
    seen = len(lan.robot.said)
    for _ in lan.watch(for_s):
        require(not is_armed(lan.robot.status), "the arm was armed without a link")
    away_mm = [status["nearest_mm"] for status in lan.robot.said[seen:] if status["nearest_mm"] is not None]
    moved_mm = max(away_mm) - min(away_mm) if away_mm else 0.0
    require(moved_mm < _STILL_MM, f"the arm moved on by {moved_mm:.1f} mm")
    return gap_ms(stop), moved_mm


def gap_ms(stop: Status) -> float:
    """The silence after which the robot side stopped the arm; CheckError for another reason, and beyond a second."""
    said = re.fullmatch(r"no command for (\d+) ms", str(stop["stopped_because"]))
    if said is None:
        raise CheckError(f"stopped because of {stop['stopped_because']}, not of the silence")
    require(float(said[1]) < _MOST_GAP_MS, f"stopped only after {said[1]} ms")
    return float(said[1])


def _all_flows(lan: Lan) -> None:
    """Stiffness goes to the operator side, and so does telemetry."""
    lan.until("operator", "stiffness and telemetry", lambda status: status["R2"] is not None and "target" in status)
    lan.moving()
    lan.until("operator", "a stiff trigger", lambda status: (status["R2"] or 0.0) + (status["L2"] or 0.0) > 0.0)
