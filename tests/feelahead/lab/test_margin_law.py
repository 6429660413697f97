"""A margin is felt by its length alone: at every travel alike, whatever the speed and the delay."""

import numpy as np
import pytest

from common.protocol.messages import TriggerField
from common.protocol.uniform_field import FAR_M, uniform_field
from feelahead.lab.approaches.margin_law import MarginLaw
from operator_side.feel.commands_under_way import Displacement
from operator_side.feel.zones import zone_strengths, zone_travels
from operator_side.hands.travel_calibration import TriggerTravel
from robot_side.ahead.law import Sensed, Situation
from robot_side.objects.perceived import Role
from tests.helpers.felt import field, ways
from tests.helpers.gripper_poses import free_pose
from tests.helpers.perceived_scenes import Scene

MARGIN_M = 0.05
NEAR = ways(0.02, 0.03, 0.04, MARGIN_M, 0.06, 0.07, 0.08, 0.09)
SITUATION = Situation(
    pose=free_pose(np.zeros((0, 3)), np.zeros(0)),
    joint_velocities_rad_s=np.zeros(6),
    objects=Scene().add(Role.OBSTACLE).objects(),
    loop_age_s=0.4,
    loop_age_known=True,
    compensation="operator",
    gap_m=None,
    held=None,
    lateral=(0.0, 0.0),
)


class Told:
    """Says what it is told to say."""

    def __init__(self, l2: TriggerField, r2: TriggerField) -> None:
        self.sensed = Sensed(
            l2=l2, r2=r2, speed_m_s=0.2, horizon_m=0.3, rumble=0.25, enlargement_m=0.09, overlap_m3=1e-6
        )
        self.asked: list[tuple[Situation, float]] = []

    def sense(self, situation: Situation, now_s: float) -> Sensed:
        self.asked.append((situation, now_s))
        return self.sensed

    def summary(self) -> dict[str, int]:
        return {"fields": 7}


def strengths(sensed: Sensed, trigger: TriggerField, moving: Displacement) -> tuple[int, ...]:
    return zone_strengths(trigger, sensed.horizon_m, zone_travels(TriggerTravel()), 0.0, moving).strengths


@pytest.mark.parametrize("moving", [Displacement(0.0, 0.0), Displacement(0.3, 0.25), Displacement(-0.3, -0.25)])
def test_ways_within_the_margin_are_felt_in_every_zone_however_fast_it_goes(moving: Displacement) -> None:
    law = MarginLaw(Told(l2=uniform_field(0), r2=field(NEAR)), MARGIN_M)
    sensed = law.sense(SITUATION, 2.0)
    felt = strengths(sensed, sensed.r2, moving)
    assert set(felt) == {4}
    assert sensed.r2.stiffness == 0.5
    assert strengths(sensed, sensed.l2, moving) == (0,) * 10


def test_without_a_margin_only_what_is_touched_is_felt() -> None:
    touched = ways(-0.01, 0.0, 0.001, 0.3)
    sensed = MarginLaw(Told(l2=field(touched), r2=field(NEAR)), 0.0).sense(SITUATION, 2.0)
    assert set(strengths(sensed, sensed.l2, Displacement(0.0, 0.0))) == {2}
    assert sensed.r2.stiffness == 0.0


def test_all_else_is_the_other_laws() -> None:
    told = Told(l2=field(NEAR, full_speed_m_s=0.2), r2=field(NEAR, acceleration_m_s2=2.0))
    law = MarginLaw(told, MARGIN_M)
    sensed = law.sense(SITUATION, 2.0)
    assert told.asked == [(SITUATION, 2.0)]
    assert (sensed.speed_m_s, sensed.rumble, sensed.enlargement_m, sensed.overlap_m3) == (0.2, 0.25, 0.09, 1e-6)
    assert (sensed.l2.full_speed_m_s, sensed.r2.acceleration_m_s2) == (0.2, 2.0)
    # Nobody is to take what it does not know for near.
    assert sensed.horizon_m == FAR_M
    assert law.summary() == {"fields": 7}
