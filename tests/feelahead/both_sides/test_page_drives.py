"""Whole runs in virtual time in which a page of the console drives, stops the arm, and tunes."""

from collections.abc import Callable
from typing import Any

import pytest

from common.roles import Role
from common.status.codes import Doing
from feelahead.both_sides.episode import Episode
from feelahead.both_sides.loopback import Loopback
from operator_side.controller.connection import Connection
from operator_side.controllers import DEVICES, OpeningParts
from operator_side.settings import OperatorSettings
from operator_side.viewing.pages.driving_page import DrivingPage
from robot_side.settings import RobotSettings
from tests.operator_side.viewing.pages.talking_page import AtThePage, Does, TalkingPage

pytestmark = pytest.mark.long

PULL: dict[str, Any] = {"run": True, "r2": 0.4}
WATCH: dict[str, Any] = {"driving": False}
GAP_S = 0.1


def run_of(does: Does, device: Any = "browser", link: str = "", *, robot: RobotSettings | None = None) -> Loopback:
    operator = OperatorSettings(link=link, device=device)
    pages = DrivingPage(may_drive=device != "hid")
    page = TalkingPage(pages)
    run = Episode(robot=robot or RobotSettings(link=link), operator=operator, pages=pages, sampled=False).loop
    opening = DEVICES[operator.device](OpeningParts(operator, run.operator, pages))
    assert opening.hands is not None
    run.connection = Connection(opening.search, run.operator)
    run.person = AtThePage(page, opening.hands, does)
    return run


def timetable(*rows: tuple[float, dict[str, Any] | None]) -> Does:
    """Return the page's inputs over time: each row's inputs hold until the row's time."""
    return lambda now_s: next((hands for until_s, hands in rows if now_s < until_s), rows[-1][1])


def advance_until(end_s: float, *after: tuple[float, dict[str, Any] | None]) -> Does:
    return timetable((2.0, {}), (3.0, {"run": True}), (end_s, PULL), *after)


def state(run: Loopback) -> str:
    return run.robot.session.safety.state


def speed_m_s(run: Loopback) -> float:
    assert run.operator.screen is not None
    return run.operator.screen.tool_speed_m_s


@pytest.mark.parametrize("link", ["", "delay 100ms 5ms distribution normal loss 2%"])
def test_a_page_arms_advances_and_a_key_up_stops(link: str) -> None:
    run = run_of(advance_until(4.0, (5.0, {"run": True}), (9.0, {})), link=link)
    run.run_until(1.99)
    assert state(run) == "disarmed"
    run.run_until(2.95)
    assert state(run) == "armed"
    assert speed_m_s(run) < 0.002
    run.run_until(3.99)
    assert speed_m_s(run) > 0.05
    delay_s = 0.2 if link else 0.0
    run.run_until(4.0 + delay_s + 2.0 * GAP_S)
    assert speed_m_s(run) < 0.005
    assert state(run) == "armed"


@pytest.mark.parametrize("after", [(99.0, None), (99.0, {}), (99.0, WATCH)], ids=["silence", "space up", "let go"])
def test_however_a_page_releases_the_arm_stops_at_once(after: tuple[float, dict[str, Any] | None]) -> None:
    run = run_of(advance_until(4.0, after))
    run.run_until(3.99)
    assert speed_m_s(run) > 0.05
    run.run_until(4.0 + 0.15 + 2.0 * GAP_S)
    assert speed_m_s(run) < 0.005
    tool = run.operator.screen
    run.run_until(6.0)
    assert tool is not None
    assert run.operator.screen is not None
    assert run.operator.screen.tool_position_m == pytest.approx(tool.tool_position_m, abs=2e-3)


def pulled_at_a_wall(until_s: float, link: str = "", **hold: Any) -> Loopback:
    robot = RobotSettings(scene="wall", link=link, roles={"target": Role.IGNORED})
    run = run_of(timetable((2.5, {}), (4.0, {"run": True}), (99.0, {"run": True} | hold)), robot=robot, link=link)
    run.run_until(until_s)
    return run


@pytest.mark.parametrize(("link", "level"), [("", 4 / 9), ("delay 200ms", 1.0)])
def test_the_pull_of_a_held_key_ends_before_a_wall(link: str, level: float) -> None:
    run = pulled_at_a_wall(12.0, link, r2=level, keyed=True)
    assert run.pages.yields == (False, True)
    assert speed_m_s(run) < 0.002
    assert run.summary()["contacts"] == 0
    assert run.summary()["min_distance_mm"] < 60.0


def test_a_finger_at_a_gamepad_is_not_held_back() -> None:
    run = pulled_at_a_wall(7.0, r2=1.0)
    assert run.pages.yields == (False, False)
    assert run.summary()["contacts"] > 0


STOP: dict[str, Any] = {"stop": True}


def stopped_at_5(does: Does) -> Does:
    return lambda now_s: STOP | WATCH if 5.0 <= now_s < 5.2 else does(now_s)


def _watches(now_s: float) -> dict[str, Any] | None:
    del now_s
    return WATCH


def person_drives() -> Loopback:
    return run_of(stopped_at_5(_watches), "simulated")


def page_drives() -> Loopback:
    return run_of(stopped_at_5(advance_until(9.0)))


@pytest.mark.parametrize("start", [person_drives, page_drives])
def test_escape_stops_any_driver_and_nobody_continues_by_themselves(start: Callable[[], Loopback]) -> None:
    run = start()
    run.run_until(4.99)
    assert state(run) == "armed"
    run.run_until(5.05)
    assert state(run) == "stopped"
    run.run_until(9.0)
    assert state(run) == "stopped"
    assert speed_m_s(run) < 0.002
    reasons = [stop["reason"] for stop in run.summary()["stops"]]
    assert "emergency stop" in reasons


def test_the_person_goes_on_from_the_start_once_they_are_told_to() -> None:
    does = timetable((5.0, WATCH), (6.0, {}), (7.0, None), (7.1, WATCH | {"give_back": True}), (20.0, WATCH))
    run = run_of(does, "simulated")
    run.run_until(4.9)
    assert state(run) == "armed"
    run.run_until(7.0)
    assert run.pages.facts(run.operator, 7.0, person=False).driver is None
    assert run.pages.doing is Doing.NOBODY_DRIVES
    assert speed_m_s(run) < 0.002
    run.run_until(10.0)
    assert state(run) == "armed"
    assert speed_m_s(run) > 0.01


def tuned(run: Loopback, at_s: float, probability: float | None, link: str | None) -> None:
    run.run_until(at_s)
    run.pages.receive(9, {"tune": {"probability": probability, "link": link}}, at_s)


def test_p_and_both_directions_of_the_link_change_while_the_run_goes_on() -> None:
    run = run_of(advance_until(3.5, (99.0, {})), robot=RobotSettings(permit_tuning=True))
    tuned(run, 5.0, 0.6, "delay 60ms")
    before = run.robot.status(5.0).enlargement_mm
    run.run_until(8.0)
    after = run.robot.status(8.0).enlargement_mm
    assert isinstance(before, float)
    assert isinstance(after, float)
    notice = run.operator.lease
    assert notice is not None
    assert (notice.probability, notice.tuned) == (0.6, 1)
    summary = run.summary()
    assert summary["link"]["to_robot"]["asked"] == summary["link"]["to_operator"]["asked"] == "delay 60ms"
    assert run.operator.link.round_trip.mean is not None
    assert run.robot.loop_age_s(8.0) > 0.11
    [granted] = summary["lease"]["tuning"]["granted"]
    assert granted == {"time_s": pytest.approx(5.06, abs=0.02), "probability": 0.6, "link": "delay 60ms"}


def test_a_jump_of_the_delay_stops_the_arm_and_the_page_drives_on_once_it_has_rested() -> None:
    does = advance_until(8.0, (10.0, {}), (11.0, {"run": True}), (12.0, PULL))
    run = run_of(does, robot=RobotSettings(permit_tuning=True))
    tuned(run, 3.5, None, "delay 400ms")
    run.run_until(7.9)
    assert state(run) == "disarmed"
    run.run_until(12.0)
    assert state(run) == "armed"
