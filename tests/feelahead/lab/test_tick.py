"""`bench tick`: its figures mean what they say, and its crowd of objects is out of reach."""

import numpy as np
import pytest

from common.roles import Role
from feelahead.lab.questions.tick import Case, rows, run
from feelahead.lab.tick.crowd import MIDDLE_M, NEAREST_M, CrowdedCamera, crowd
from feelahead.lab.tick.sent_crowd import SentCamera
from feelahead.lab.tick.timed_robot import COLUMNS
from robot_side.drivers.mujoco.camera import MujocoCamera
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.surroundings.surroundings import Surroundings
from robot_side.surroundings.validity import require_valid


def test_a_crowd_is_valid_and_out_of_the_way() -> None:
    frame = crowd(100, 0.0)
    require_valid(frame)
    assert len(frame.names) == len(set(frame.names)) == 100
    owners = np.concatenate([frame.sphere_object, frame.box_object, frame.tetrahedron_object])
    assert sorted(owners) == list(range(100))
    corners = frame.tetrahedron_vertices_m.mean(axis=1)
    for centers_m in (frame.sphere_centers_m, frame.box_centers_m, corners):
        assert np.linalg.norm(centers_m - MIDDLE_M, axis=1).min() >= NEAREST_M - 1e-9


@pytest.mark.parametrize("again", [False, True])
def test_a_crowd_that_is_sent_is_perceived_whole_and_anew_if_it_comes_again(again: bool) -> None:
    camera = SentCamera(30, Surroundings(), again=again)
    frames = [camera.perceive(0.05 * step) for step in range(1, 9)]
    assert set(frames[0].names) == {f"crowd {k}" for k in range(30)}
    assert frames[0].sphere_radii_m == pytest.approx(crowd(30, 0.0).sphere_radii_m)
    assert len({frame.time_s for frame in frames}) == (5 if again else 1)


def test_of_a_crowd_around_a_cameras_objects_a_frame_says_what_moves() -> None:
    scene = load_scene()
    camera = CrowdedCamera(MujocoCamera(scene), 300)
    first, second = camera.perceive(0.0), camera.perceive(0.5)
    assert camera.perceive(0.5) is second
    require_valid(first)
    require_valid(second)
    assert second.since is not None
    assert second.since[0].first is first
    own = [thing.name for thing in scene.objects if thing.name not in scene.fixed]
    assert [second.names[thing] for thing in second.since[0].things] == own
    assert len(second.roles) == len(second.names) == len(scene.objects) + 300
    # While nobody changes a role, all frames share one tuple.
    assert camera.perceive(1.0).roles is second.roles is first.roles
    camera.set_role(own[0], Role.TARGET)
    assert camera.perceive(1.5).roles[second.names.index(own[0])] is Role.TARGET


def test_look_to_message_leaves_out_physics_and_frames_and_stands_beside_mixed() -> None:
    tick = dict.fromkeys(COLUMNS, 0.0) | {"spent_s": 80e-6, "physics": 30e-6, "frame": 20e-6, "law": 40e-6}
    turns = np.array([[tick[column] for column in COLUMNS]] * 4)
    turns[:, COLUMNS.index("run")] = 0, 0, 0, 1
    turns[:, 0], turns[:, COLUMNS.index("thread_s")] = (0.0, 1.0, 2.0, 3.0), (0.0, 0.5, 1.0, 2.0)
    turns[1, COLUMNS.index("looks")], turns[1, COLUMNS.index("law")] = 1, 60e-6
    turns[3, COLUMNS.index("spent_s")] = 200e-6
    found = {row["stage"]: row for row in rows(turns, stages=True, overruns=0)}
    assert found["look to message"]["p50_us"] == pytest.approx(50.0)
    assert found["look to message"]["p50_of_mixed"] == pytest.approx(0.25)
    assert found["without physics"]["p50_us"] == pytest.approx(70.0)
    assert found["the rest"]["p50_us"] == pytest.approx(10.0)
    assert found["whole look"]["p50_us"] == pytest.approx(60.0)
    assert found["tick"]["share"] == pytest.approx(0.5)
    assert found["mixed"]["p99_of_mixed"] == 1.0


@pytest.mark.processes
def test_a_real_robot_side_is_timed() -> None:
    found = {row["stage"]: row for row in run(Case("10 objects", 1.5, stages=True, objects=10), 0)}
    assert found["tick"]["p50_us"] > found["look to message"]["p50_us"] > 0.0
    assert found["law"]["p50_us"] > 0.0
    assert found["mixed"]["p50_us"] > 0.0
