"""Faults of the network between both sides: cable, addresses, firewall, packet size, name server."""

import math
import re
import shutil
import time

import pytest

from tests.helpers.machines.quiet import judged
from tests.two_hosts.lan import Lan, Status, is_armed, silence

pytestmark = [pytest.mark.two_hosts, pytest.mark.processes]

_STILL_MM = 2.0


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
    print(f"stopped by {silence(stop)}; armed again {time.monotonic() - began_s:.1f} s after the change")


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
    lan.restart()  # the whole task lies ahead of the person
    lan.moving()
    for host in hosts:
        host.machine.set_link("mtu", "576")
    all_flows(lan)
    lan.restart()
    all_flows(lan)
    segment = re.search(r"\bmss:(\d+)", lan.operator_host.run("ss -tin state established '( dport = :5555 )'"))
    for host in hosts:
        host.machine.set_link("mtu", "1500")
    assert segment is not None
    assert int(segment[1]) <= 536  # 576 bytes without the headers of IP and TCP


@pytest.mark.quiet
def test_the_arm_stops_120_ms_after_the_last_command_at_most(lan: Lan) -> None:
    lan.moving()
    with judged():
        lan.robot_host.machine.unplug()
        stop = lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
        said = re.fullmatch(r"no command for (\d+) ms", silence(stop))
        assert said is not None
        assert float(said[1]) <= 120.0
    lan.robot_host.machine.plug_in()
    lan.back()


def stopped(lan: Lan, for_s: float) -> None:
    """Wait until the arm is stopped and the triggers are free; assert that the arm stays so, and still, for `for_s`."""
    stop = lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
    lan.until("operator", "the triggers are free", lambda status: status["triggers_released"] is True)
    lan.until("operator", "it is blind", lambda status: status["feel"] == "blind")
    before_mm = [math.inf]

    def rests(status: Status) -> bool:
        moved_mm, before_mm[0] = abs((status["nearest_mm"] or 0.0) - before_mm[0]), status["nearest_mm"] or 0.0
        return bool(moved_mm < _STILL_MM)

    lan.until("robot", "the arm rests", rests)
    seen = len(lan.robot.said)
    for _ in lan.watch(for_s):
        assert not is_armed(lan.robot.status), "armed without a link"
    away_mm = [status["nearest_mm"] for status in lan.robot.said[seen:] if status["nearest_mm"] is not None]
    assert not away_mm or max(away_mm) - min(away_mm) < _STILL_MM
    print(f"stopped by {silence(stop)}")


def all_flows(lan: Lan) -> None:
    """Wait until the operator side gets stiffness and telemetry, and a trigger becomes stiff."""
    lan.until("operator", "stiffness and telemetry", lambda one: one["R2_meets"] is not None and "target" in one)
    lan.moving()
    lan.while_driving("a stiff trigger", lambda one: (one["R2_meets"] or 0) + (one["L2_meets"] or 0) > 0)
