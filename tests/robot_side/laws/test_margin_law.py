"""A fixed margin: full strength within it, nothing beyond, whatever the speed, the delay and the errors."""

import dataclasses

import numpy as np
import pytest

from robot_side.laws.named import make_law
from robot_side.laws.paper import MarginLaw
from robot_side.laws.paper_settings import PaperSettings
from tests.helpers.field.fields import ball_pose
from tests.helpers.field.situations import inputs, situation, walls

MARGIN_M = 0.03


def margin_law(**changes: float) -> MarginLaw:
    settings = PaperSettings(share=2e-5, margin_m=MARGIN_M)
    law = make_law("margin", dataclasses.replace(inputs(**changes), paper=settings))
    assert isinstance(law, MarginLaw)
    return law


@pytest.mark.parametrize("loop_age_s", [0.02, 1.0])
@pytest.mark.parametrize("speed_rad_s", [0.0, 0.5])
@pytest.mark.parametrize("camera_sd_m", [0.0, 0.02])
def test_it_is_felt_within_the_margin_and_nowhere_else(
    loop_age_s: float, speed_rad_s: float, camera_sd_m: float
) -> None:
    for beyond_m, full in ((-0.002, True), (0.001, False)):
        objects = walls(MARGIN_M + beyond_m)
        law = margin_law(camera_sd_m=camera_sd_m)
        moving = situation(ball_pose(), objects, loop_age_s=loop_age_s, joint_velocities_rad_s=np.full(6, speed_rad_s))
        sensed = law.sense(moving, 0.0)
        assert (sensed.r2.course_stiffness > 0.9) is full
        assert sensed.enlargement_m == pytest.approx(MARGIN_M)
        assert law.explain("r2", moving, sensed).sigma_m == pytest.approx(MARGIN_M)
