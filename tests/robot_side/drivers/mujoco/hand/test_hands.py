"""What is measured of other people's hands: the gap at their fingertips, and the inputs that move them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.errors import ConfigurationError
from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.checks.joints import joint_findings
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.gripper_measurement import GripperTravel, measure_gripper
from robot_side.drivers.mujoco.scene import load_scene
from tests.robot_side.drivers.mujoco.hand.hands import APART, SLIDING, Hand, motor, servo

L_SHAPED = Hand(
    """
  <body name="left"><joint name="left" class="slide" range="0 0.0345"/>
    <geom type="box" pos="0.005 0 0.09" size="0.005 0.01 0.02" mass="0.05"/>
    <geom type="box" pos="-0.01 0.016 0.076" size="0.03 0.004 0.006" mass="0.05"/></body>
  <body name="right"><joint name="right" class="slide" axis="-1 0 0" range="0 0.0345"/>
    <geom type="box" pos="-0.005 0 0.09" size="0.005 0.01 0.02" mass="0.05"/>
    <geom type="box" pos="0.01 -0.016 0.076" size="0.03 0.004 0.006" mass="0.05"/></body>""",
    servo("0 0.0345"),
)
SCISSORS = Hand(
    """
  <body name="left" pos="0.006 0 0.04"><joint name="left" class="turn" range="0.03 0.8"/>
    <geom type="capsule" fromto="0 0 0 0 0 0.062" size="0.008" mass="0.05"/></body>
  <body name="right" pos="-0.006 0 0.04"><joint name="right" class="turn" axis="0 -1 0" range="0.03 0.8"/>
    <geom type="capsule" fromto="0 0 0 0 0 0.062" size="0.008" mass="0.05"/></body>""",
    servo("0.03 0.8", kp="20", kv="1", forcerange="-4 4"),
)
STILL_JAW = '<geom type="box" pos="-0.005 0 0.07" size="0.005 0.01 0.04" mass="0.05"/>'
ONE_TURNING = Hand(
    STILL_JAW
    + """
  <body name="left" pos="0.025 0 0.03"><joint name="left" class="turn" range="0 1.6"/>
    <geom type="box" pos="-0.02 0 0.04" size="0.005 0.01 0.04" mass="0.05"/></body>""",
    servo("0 1.6", kp="20", kv="1", forcerange="-4 4"),
    excluded="",
    below="",
)
ONE_SLIDING = Hand(
    STILL_JAW
    + """
  <body name="left"><joint name="left" class="slide" range="0 0.05"/>
    <geom type="cylinder" pos="0.008 0 0.09" size="0.008 0.02" mass="0.05"/></body>""",
    servo("0 0.05"),
    excluded="",
    below="",
)
TWO_AGAINST_ONE = Hand(
    """
  <body name="left"><joint name="left" class="slide"/>
    <geom type="box" pos="0.005 0 0.09" size="0.005 0.006 0.02" mass="0.05"/></body>
  <body name="right"><joint name="right" class="slide" axis="-1 0 0"/>
    <geom type="box" pos="-0.005 0.02 0.09" size="0.005 0.006 0.02" mass="0.05"/>
    <geom type="box" pos="-0.005 -0.02 0.09" size="0.005 0.006 0.02" mass="0.05"/></body>"""
)
STAR = Hand(
    "".join(
        f"""
  <body name="{name}" euler="0 0 {turn_rad}"><joint name="{name}" class="slide"/>
    <geom type="box" pos="0.006 0 0.09" size="0.005 0.003 0.02" mass="0.05"/></body>"""
        for name, turn_rad in (("left", 0.3), ("right", 2.394), ("third", 4.489))
    ),
    servo(),
    APART + '<exclude body1="hand" body2="third"/>',
    '<equality><joint joint1="left" joint2="right"/><joint joint1="left" joint2="third"/></equality>',
)
HEAVY = replace(
    ONE_TURNING,
    jaws=ONE_TURNING.jaws.replace('0.05"/></body>', '0.3"/></body>'),
    actuators=servo("0 1.6", kp="2", kv="0.2", forcerange="-4 4"),
    gravity="9.81 0 0",
    post_at_m=0.01,
)
# Drawn pads on long fingers, which have knuckles that meet first.
KNUCKLES = Hand(
    "".join(
        f"""
  <body name="{name}"><joint name="{name}" class="slide" axis="{side} 0 0"/>
    <geom type="mesh" mesh="pad" pos="{side * 0.005} 0 0.09" mass="0.02"/>
    <geom type="box" pos="{side * 0.015} 0 0.06" size="0.005 0.01 0.05" mass="0.02"/>
    <geom type="sphere" pos="{side * 0.006} 0 0.05" size="0.01" mass="0.02"/></body>"""
        for name, side in (("left", 1), ("right", -1))
    ),
    excluded='<exclude body1="hand" body2="right"/>',
)

# A part of the hand stops the right jaw after half of its way.
HALF_CLOSED = Hand(
    '<body><geom type="box" pos="0.006 0.02 0.09" size="0.005 0.002 0.005"/></body>'
    + SLIDING.replace(
        '<body name="right">',
        '<body name="right"><geom type="box" pos="-0.02 0.02 0.09" size="0.006 0.01 0.004" mass="0.01"/>',
    ),
    excluded='<exclude body1="left" body2="right"/>',
)


def measured(hand: Hand, path: Path) -> GripperTravel:
    travel = measure_gripper(load_scene(hand.written(path), "tool"))
    assert travel is not None
    return travel


@pytest.mark.parametrize(
    ("hand", "open_mm", "closed_mm", "both_move"),
    [
        pytest.param(Hand(), 60.0, 0.0, True, id="sliding"),
        pytest.param(L_SHAPED, 69.0, 0.0, True, id="L-shaped"),
        pytest.param(SCISSORS, 70.0, 0.0, True, id="scissors"),
        pytest.param(ONE_TURNING, 93.0, 0.0, False, id="one turns"),
        pytest.param(ONE_SLIDING, 50.0, 0.0, False, id="one slides"),
        pytest.param(TWO_AGAINST_ONE, 60.0, 0.0, True, id="two against one"),
        pytest.param(STAR, 54.0, 3.0, True, id="star"),
        pytest.param(KNUCKLES, 60.0, 8.0, True, id="knuckles"),
        pytest.param(replace(L_SHAPED, tool_m=0.02), 69.0, 0.0, True, id="site far behind"),
        pytest.param(replace(L_SHAPED, tool_m=0.125), 69.0, 0.0, True, id="site beyond"),
    ],
)
def test_the_gap_is_that_at_the_fingertips(
    hand: Hand, open_mm: float, closed_mm: float, both_move: bool, tmp_path: Path
) -> None:
    travel = measured(hand, tmp_path)
    assert 1e3 * travel.openings_m[[0, -1]] == pytest.approx([open_mm, closed_mm], abs=3.0)
    assert (np.diff(travel.openings_m) < 1e-4).all()
    assert [jaw.moves for jaw in travel.jaws].count(True) == 1 + both_move
    assert abs(travel.closing[0]) > 0.9


_POST_M = 0.02
WIDE, WIDER = "-0.135 0.165", "-1.485 1.515"
TENDON = """<tendon><fixed name="split">
    <joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed></tendon>
  <equality><joint joint1="left" joint2="right"/></equality>"""
OPENED = SLIDING.replace('class="slide"', 'class="slide" stiffness="200" springref="0.03"')
BOTH = Hand(SLIDING.replace('axis="-1 0 0"', 'range="-0.03 0"'), below="")
# One jaw sags open, the other one closed: together they have hardly moved.
ON_ITS_SIDE = replace(
    BOTH,
    jaws=BOTH.jaws.replace('mass="0.05"', 'mass="0.2"'),
    actuators=servo(kp="600") + servo("-0.03 0", "right", kp="600"),
)


@pytest.mark.parametrize(
    "hand",
    [
        pytest.param(Hand(), id="exact"),
        pytest.param(Hand(actuators=servo(WIDE)), id="ten times the travel"),
        pytest.param(Hand(actuators=servo(WIDER)), id="a hundred times"),
        pytest.param(Hand(actuators=servo(WIDE, forcerange="-1e5 1e5")), id="without force limit"),
        pytest.param(Hand(actuators=servo("0 0.3")), id="dead when open"),
        pytest.param(Hand(actuators=servo("-0.3 0.03")), id="dead when closed"),
        pytest.param(Hand(actuators=servo("-0.165 0.135", gear="-1")), id="inverted"),
        pytest.param(replace(BOTH, actuators=servo() + servo("-0.03 0", "right")), id="opposed"),
        pytest.param(replace(BOTH, actuators=servo(WIDE) + servo("-0.3 0.3", "right")), id="opposed, wide, unequal"),
        pytest.param(Hand(SLIDING.replace('class="slide"', 'class="slide" frictionloss="1.5"')), id="dry friction"),
        pytest.param(Hand(SLIDING.replace('class="slide"', 'class="slide" damping="100"')), id="slow"),
        pytest.param(Hand(OPENED, servo(forcerange="-40 0")), id="pulls against a spring"),
        pytest.param(Hand(OPENED, motor('forcerange="-30 0"')), id="motor that pulls against a spring"),
        pytest.param(
            Hand(OPENED.replace("200", "20").replace("0.03", "0"), servo(forcerange="0 40")), id="closed by a spring"
        ),
        pytest.param(Hand(actuators=motor()), id="motor"),
        pytest.param(Hand(actuators=motor('dyntype="filter" dynprm="0.05"')), id="motor with a time constant"),
        pytest.param(Hand(actuators='<velocity joint="left" kv="200" ctrlrange="-0.1 0.1"/>'), id="speed"),
        pytest.param(
            Hand(actuators='<intvelocity joint="left" kp="1000" ctrlrange="-0.1 0.1" actrange="0 0.03"/>'),
            id="integrated speed",
        ),
        pytest.param(Hand(actuators='<motor tendon="split" ctrlrange="-40 40"/>', below=TENDON), id="motor on tendon"),
        pytest.param(L_SHAPED, id="L-shaped"),
        pytest.param(SCISSORS, id="scissors"),
        pytest.param(replace(ONE_SLIDING, post_at_m=0.01), id="one slides"),
        pytest.param(
            replace(SCISSORS, actuators=servo("-3 3", kp="20", kv="1", forcerange="-4 4")), id="wide scissors"
        ),
        pytest.param(replace(ONE_TURNING, post_at_m=0.01), id="one turns"),
        pytest.param(HEAVY, id="weight"),
        *(
            pytest.param(replace(ON_ITS_SIDE, gravity=gravity), id=f"on its side, {gravity}")
            for gravity in ("9.81 0 0", "-6.9 0 -6.9")
        ),
        pytest.param(KNUCKLES, id="knuckles"),
        pytest.param(HALF_CLOSED, id="stopped half closed"),
        pytest.param(
            replace(HALF_CLOSED, actuators=servo() + servo("0 0.03", "right"), below=""), id="one jaw stopped"
        ),
    ],
)
def test_a_hand_never_holds_nothing_and_holds_a_post(hand: Hand, tmp_path: Path) -> None:
    for post_m in (0.0, _POST_M):
        scene = load_scene(hand.written(tmp_path, post_m), "tool")
        arm, now_s = MujocoArm(scene, Encoder(0.0, 0.0)), 0.0
        arm.state(now_s)
        travel, ends, held = arm.travel, [], False
        assert travel is not None
        for closing, duration_s in ((1.0, 1.2), (0.0, 0.3), (-1.0, 1.0), (1.0, 0.25), (0.0, 0.5), (1.0, 1.2)):
            for _ in range(round(duration_s / 0.004)):
                now_s += 0.004
                arm.command_gripper(closing, now_s + 0.1)
                state = arm.state(now_s)
                held |= state.gripper_holding
            ends.append((state.gripper_holding, state.gripper_opening_m))
        closed_m = post_m or float(travel.openings_m[-1])
        assert [opening_m for _, opening_m in ends] == pytest.approx(
            [closed_m, closed_m, travel.openings_m[0], ends[3][1], ends[4][1], closed_m], abs=5e-3
        )
        assert ends[3][1] > ends[4][1] - 1e-3 > closed_m + 5e-3
        assert [held for held, _ in ends] == [post_m > 0.0, post_m > 0.0, False, False, False, post_m > 0.0]
        assert held == (post_m > 0.0)


@pytest.mark.parametrize(
    ("hand", "why"),
    [
        # The jaw's weight takes 0.1 N m of it.
        pytest.param(
            replace(HEAVY, actuators=servo("0 1.6", kp="20", kv="1", forcerange="-0.2 0.2")),
            "the hand's own parts resist its drive as much as an object could",
            id="weak",
        ),
        pytest.param(
            Hand(actuators=motor('biastype="affine" biasprm="0 -1e-3 -20"')),
            "the hand's actuators do not bring its fingers together over the whole of their ctrlrange",
            id="one input moves it all the way",
        ),
    ],
)
def test_a_hand_that_cannot_grasp_is_named(hand: Hand, why: str, tmp_path: Path) -> None:
    scene = load_scene(hand.written(tmp_path), "tool")
    assert f"{why}: nothing can be grasped" in joint_findings(scene, measure_gripper(scene))


def test_a_motor_without_a_range_is_named(tmp_path: Path) -> None:
    endless = Hand(
        SLIDING.replace('class="slide"', 'type="slide"'), '<motor name="grip" joint="left" ctrlrange="-1 1"/>'
    )
    with pytest.raises(
        ConfigurationError, match="'grip' takes forces or speeds, and moves joints without a range; valid: "
    ):
        load_scene(endless.written(tmp_path), "tool")
