import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_side.surroundings.velocities import WINDOW_S, ObjectVelocities

FRAME_S = 1.0 / 30.0


@settings(derandomize=True, deadline=None)
@given(speed=st.floats(-2.0, 2.0), frames=st.integers(2, 40))
def test_a_steady_motion_has_its_velocity(speed: float, frames: int) -> None:
    seen = ObjectVelocities()
    for frame in range(frames):
        time_s = 100.0 + frame * FRAME_S
        found = seen.see(time_s, np.array([[speed * time_s, 0.0, 1.0], [0.0, 2.0, -0.5 * speed * time_s]]))
    np.testing.assert_allclose(found, [[speed, 0.0, 0.0], [0.0, 0.0, -0.5 * speed]], atol=1e-9)


def test_one_frame_alone_means_rest() -> None:
    seen = ObjectVelocities()
    assert (seen.see(0.0, np.ones((3, 3))) == 0.0).all()
    assert (seen.see(0.0, np.zeros((3, 3))) == 0.0).all()


def test_what_has_stopped_is_at_rest_after_the_window() -> None:
    seen = ObjectVelocities()
    for frame in range(60):
        time_s = frame * FRAME_S
        found = seen.see(time_s, np.array([[min(time_s, 1.0), 0.0, 0.0]]))
        if time_s > 1.0 + WINDOW_S + 1e-9:
            assert (np.abs(found) < 1e-9).all()


def test_another_number_of_objects_is_refused() -> None:
    seen = ObjectVelocities()
    seen.see(0.0, np.zeros((2, 3)))
    with pytest.raises(ValueError, match="positions_m holds 3 positions; valid: 2"):
        seen.see(0.1, np.zeros((3, 3)))
