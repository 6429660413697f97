"""Faults of the network between both sides: cable, addresses, firewall, packet size, name server."""

import re
import shutil
import time
from collections.abc import Callable

import pytest

from tests.two_hosts.lan import ATTEMPTS, Lan, gap_ms, is_armed

pytestmark = [pytest.mark.two_hosts, pytest.mark.processes]

_MOST_SEGMENT = 536
"""Maximum TCP segment in bytes: packets of 576 bytes without the headers of IP and TCP"""
_STILL_MM = 2.0
_SETTLES_S = 0.5


def test_after_the_guide_all_flows(lan: Lan) -> None:
    all_flows(lan)
    lan.ask_doctor(0, "somebody has the arm")
    clocks = "clocks 28 h apart" if lan.own_clocks else "one clock: no time namespaces here"
    print(f"delay {lan.operator.status['delay_ms']:.1f} ms, {clocks}")


@pytest.mark.parametrize("pause_s", [1.0, 6.0], ids=["for a second", "for longer than any connection lives"])
def test_a_cable_pulled(lan: Lan, pause_s: float) -> None:
    lan.moving()
    lan.robot_host.machine.unplug()
    stopped(lan, pause_s)
    lan.ask_doctor(1, "route")
    lan.robot_host.machine.plug_in()
    lan.back()


@pytest.mark.parametrize("side", ["operator", "robot"])
def test_an_address_that_changes(lan: Lan, side: str) -> None:
    """The link returns by itself: the operator side knows the robot's machine by its name."""
    lan.moving()
    began_s = time.monotonic()
    if side == "operator":
        lan.operator_host.machine.readdress("198.18.0.3")
    else:
        lan.robot_host.machine.readdress("198.18.0.4")
        lan.tell_name("198.18.0.4")
    stop = lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
    lan.until("operator", "the link is lost", lambda status: status["link"] != "up")
    lan.back()
    print(f"stopped after {gap_ms(stop):.0f} ms; armed again {time.monotonic() - began_s:.1f} s after the change")


def test_a_network_that_swallows_everything(lan: Lan) -> None:
    """Packets get no answer, not even a refusal. The operator side must still try again to connect."""
    if shutil.which("nft") is None:
        pytest.skip("no nft here (apt install nftables)")
    lan.moving()
    lan.swallow(True)
    stopped(lan, 12.0)
    lan.swallow(False)
    lan.back()


def test_packets_of_576_bytes(lan: Lan) -> None:
    """Both machines' limit of packet size falls to 576 bytes, under open connections and before new ones."""
    hosts = (lan.robot_host, lan.operator_host)
    for host in hosts:
        host.machine.set_link("mtu", "576")
    all_flows(lan)
    lan.end("operator")
    lan.start("operator")
    lan.moving()
    all_flows(lan)
    segment = re.search(r"\bmss:(\d+)", lan.operator_host.run("ss -tin state established '( dport = :5555 )'"))
    for host in hosts:
        host.machine.set_link("mtu", "1500")
    assert segment is not None
    assert int(segment[1]) <= _MOST_SEGMENT


def test_a_name_server_that_is_silent(lan: Lan) -> None:
    """With a name server that does not answer, control goes on while views reconnect after a revocation.

    Both sides also end in time, the operator side while it waits for the name server.
    """
    key = lan.words["OPERATOR-KEY"][:-4]

    def undisturbed(attempt: int) -> bool:
        lan.robot_host.run(f"feelahead keys allow carol{attempt} {key}{attempt:04d}")
        lan.moving()
        lan.tell_name(None)
        lan.robot_host.run(f"feelahead keys revoke carol{attempt}")
        return all(is_armed(lan.robot.status) for _ in lan.watch(2.0))

    once_in(lan, undisturbed, lambda: lan.tell_name(lan.robot_host.machine.address))
    lan.end("robot")
    lan.until("operator", "the link is lost", lambda status: status["link"] != "up")
    lan.end("operator")
    lan.tell_name(lan.robot_host.machine.address)
    lan.restart()


def once_in(lan: Lan, tried: Callable[[int], bool], undo: Callable[[], None]) -> None:
    """Try an action `ATTEMPTS` times at most, as a busy machine may spoil it; `undo` follows each failure."""
    for attempt in range(ATTEMPTS):
        if tried(attempt):
            return
        why = lan.robot.status["stopped_because"]
        undo()
        lan.back()
    pytest.fail(f"the arm was stopped each time: {why}")


def stopped(lan: Lan, for_s: float) -> None:
    """Wait until the arm is stopped and the triggers are free; assert that the arm stays so, and still, for `for_s`."""
    stop = lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
    lan.until("operator", "the triggers are free", lambda status: status["triggers_released"] is True)
    lan.until("operator", "it is blind", lambda status: status["feel"] == "blind")
    for _ in lan.watch(_SETTLES_S):
        pass
    seen = len(lan.robot.said)
    for _ in lan.watch(for_s):
        assert not is_armed(lan.robot.status), "armed without a link"
    away_mm = [status["nearest_mm"] for status in lan.robot.said[seen:] if status["nearest_mm"] is not None]
    assert not away_mm or max(away_mm) - min(away_mm) < _STILL_MM
    print(f"stopped after {gap_ms(stop):.0f} ms")


def all_flows(lan: Lan) -> None:
    """Wait until the operator side gets stiffness and telemetry, and a trigger becomes stiff."""
    lan.until("operator", "stiffness and telemetry", lambda status: status["R2"] is not None and "target" in status)
    lan.moving()
    lan.until("operator", "a stiff trigger", lambda status: (status["R2"] or 0.0) + (status["L2"] or 0.0) > 0.0)
