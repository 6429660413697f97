"""A second operator; and sides that are killed, started in the other order, or get another wall-clock time."""

import time

import pytest

from tests.two_hosts.lan import Lan, is_armed

pytestmark = [pytest.mark.two_hosts, pytest.mark.processes]

_REFUSED = "does not let this key in"


def test_a_second_operator_watches_until_revoked(lan: Lan) -> None:
    bob = lan.operator_host.user("bob")
    bob.run("feelahead keys make operator")
    lan.robot_host.run(f"feelahead keys allow bob {bob.run('feelahead keys show operator').strip()}")
    lan.moving()
    # The same person as at the other controller: they try to arm and to drive.
    bobs = lan.start("operator", bob, called="bob")
    lan.until("bob", "watching", lambda status: status["link"] == "observing")
    lan.until("robot", "an observer", lambda status: status["observers"] == 1)
    lan.until("operator", "armed", is_armed)
    for _ in lan.watch(1.5):
        assert bobs.status["link"] != "up"
    lan.robot_host.run("feelahead keys revoke bob")
    began_s = time.monotonic()
    lan.until("bob", "out", lambda status: _REFUSED in str(status["link_reason"]))
    lan.until("robot", "no observer", lambda status: status["observers"] == 0)
    print(f"out {time.monotonic() - began_s:.1f} s after the revocation")
    lan.end("bob")
    lan.until("robot", "anna's link", lambda status: status["link"] == "up")


def test_revoked_while_driving(lan: Lan) -> None:
    lan.moving()
    lan.robot_host.run("feelahead keys revoke anna")
    began_s = time.monotonic()
    lan.until("robot", "the arm is stopped", lambda status: not is_armed(status))
    print(f"stopped {time.monotonic() - began_s:.1f} s after the command")
    lan.until("operator", "out", lambda status: _REFUSED in str(status["link_reason"]))
    lan.until("operator", "the triggers are free", lambda status: status["triggers_released"] is True)
    lan.robot_host.run(f"feelahead keys allow anna {lan.words['OPERATOR-KEY']}")
    lan.back()


def test_the_operator_side_first(lan: Lan) -> None:
    for side in ("operator", "robot"):
        lan.end(side)
    lan.start("operator")
    lan.until("operator", "it waits", lambda status: status["link"] == "waiting")
    lan.start("robot")
    lan.until("robot", "it listens", bool)
    lan.back()
