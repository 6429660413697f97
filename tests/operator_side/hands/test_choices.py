import math

import pytest

from common.protocol.messages import Header
from operator_side.hands.choices import Choices
from operator_side.hands.intent import OperatorIntent
from tests.helpers.messages import telemetry

PRESSED, RELEASED = OperatorIntent(next_speed=True), OperatorIntent()


@pytest.mark.parametrize(("first", "expected"), [(1.0, [0.5, 0.25, 1.0, 0.5]), (0.3, [0.25, 1.0, 0.5, 0.25])])
def test_each_press_selects_the_next_speed_scale(first: float, expected: list[float]) -> None:
    choices, found = Choices(first), []
    for _ in expected:
        for intent in (PRESSED, PRESSED, RELEASED):
            choices.read(intent)
        found.append(choices.speed_scale)
    assert found == expected


@pytest.mark.parametrize("busy", [{"l2": 0.1}, {"r2": 0.1}, {"lateral": (0.0, 0.1)}, {"turning": (0.1, 0.0)}])
def test_a_press_takes_effect_at_rest(busy: dict[str, float]) -> None:
    choices = Choices()
    choices.read(OperatorIntent(next_speed=True, **busy))  # type: ignore[arg-type]
    choices.read(OperatorIntent(**busy))  # type: ignore[arg-type]
    assert choices.speed_scale == 1.0
    choices.read(RELEASED)
    assert choices.speed_scale == 0.5


def test_the_scale_multiplies_triggers_and_sticks_only() -> None:
    meant = OperatorIntent(l2=0.2, r2=0.8, lateral=(0.4, -0.2), turning=(-1.0, 0.6), run=True, gripper=-1)
    assert Choices().commanded(meant, 0.0) is meant
    half = OperatorIntent(l2=0.1, r2=0.4, lateral=(0.2, -0.1), turning=(-0.5, 0.3), run=True, gripper=-1)
    assert Choices(0.5).commanded(meant, 0.0) == half


def test_a_scale_out_of_range_is_refused() -> None:
    with pytest.raises(ValueError, match="speed_scale"):
        Choices(0.01)


def test_each_press_selects_the_next_frame() -> None:
    choices, found = Choices(), []
    for _ in range(4):
        for intent in (OperatorIntent(next_frame=True), RELEASED):
            choices.read(intent)
        found.append(choices.stick_frame)
    assert found == ["base", "camera", "tool", "base"]


def test_the_sticks_are_turned_by_the_newest_angle_and_rest_without_one() -> None:
    meant = OperatorIntent(r2=0.5, lateral=(0.8, 0.0), turning=(0.0, 0.5))
    still = OperatorIntent(r2=0.5)
    for frame, right, up in (("base", (0.0, 0.8), (-0.5, 0.0)), ("camera", (-0.8, 0.0), (0.0, -0.5))):
        choices = Choices(stick_frame=frame)  # type: ignore[arg-type]
        assert choices.commanded(meant, 1.0) == still
        angles = {"base_turn_rad": math.pi / 2.0, "camera_turn_rad": math.pi}
        choices.see(telemetry(Header(1, 1, 0.0), **angles), 1.0)
        turned = choices.commanded(meant, 1.9)
        assert turned.r2 == 0.5
        assert turned.lateral == pytest.approx(right, abs=1e-12)
        assert turned.turning == pytest.approx(up, abs=1e-12)
        assert choices.commanded(meant, 2.1) == still


def test_up_changes_sides_for_a_tool_that_faces_the_camera_only_at_rest() -> None:
    choices, meant = Choices(stick_frame="camera"), OperatorIntent(lateral=(0.0, 1.0))
    choices.see(telemetry(Header(1, 1, 0.0)), 1.0)
    for faces, turn_rad in ((False, 0.0), (True, 0.5 * math.pi)):
        choices.see(telemetry(Header(1, 1, 0.0), camera_faces=faces, camera_turn_rad=turn_rad), 1.0)
        choices.read(meant)
        assert choices.commanded(meant, 1.0).lateral == (0.0, 1.0)
    choices.read(RELEASED)
    assert choices.commanded(meant, 1.0).lateral == pytest.approx((1.0, 0.0), abs=1e-12)
    unknown = Choices(stick_frame="camera")
    unknown.see(telemetry(Header(1, 1, 0.0), camera_faces=True), 1.0)
    assert unknown.commanded(meant, 1.0).lateral == (0.0, 0.0)
