"""Which pictures and scenes are sent to operators who ask for views, when and how many, in virtual time."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.emulation.spec import LinkSpec
from common.protocol.messages import Tune
from robot_side.settings import CameraSettings, RobotSettings
from tests.robot_side.viewing.view_table import TABLES, Table

ALL = {"overview": True, "first_person": True, "scene": True}


@pytest.fixture(autouse=True)
def _cleared_away() -> Iterator[None]:
    yield
    while TABLES:
        TABLES.pop().desk.close()


def rows(values: bytes, width: int) -> FloatArray:
    return np.frombuffer(values, "<f4").reshape(-1, width).astype(np.float64)


def test_nobody_looks_nothing_is_made() -> None:
    table = Table()
    table.run(2.0)
    assert table.seen == []
    assert table.desk.companions == []
    for counts in ("overview", "first_person", "scene"):
        made = table.looking.summary()[counts]
        assert made["sent"] == 0
        assert 55 <= made["nobody_looks"] <= 61
        assert made["due"] == made["nobody_looks"]
    done, of = table.looking.pictures_sent
    assert done == 0
    assert 110 <= of <= 122


def test_watched_views_come_thirty_times_a_second_until_a_second_after_the_last_watch() -> None:
    table = Table()
    table.watch(**ALL)
    table.run(3.0)
    views = Counter(frame.view for frame in table.frames())
    assert all(80 <= views[view] <= 90 for view in ("overview", "first_person"))
    assert table.looking.pictures_sent.done == len(table.frames())
    assert 80 <= len(table.states()) <= 90
    assert len(table.shapes()) == 1
    # Ordered in the turn of its stamp, answered 4 ms later.
    assert table.ages_s["video"] == [0.0] * len(table.frames())
    assert all(0.004 <= frame.header.sent_s - frame.captured_s < 0.008 for frame in table.frames())
    table.watching = {}
    table.run(2.0)
    before = len(table.seen)
    table.run(1.0)
    assert len(table.seen) == before
    newest_s = max(state.taken_s for state in table.states())
    assert 3.6 < newest_s < 3.8  # The last Watch came at 2.75 s.


def test_shapes_come_again_every_three_seconds_and_when_another_begins_to_look() -> None:
    table = Table()
    table.watch(scene=True)
    table.run(7.0)
    assert len(table.shapes()) == 3
    table.watching = {}
    table.run(2.0)
    table.watch(scene=True)
    table.run(0.5)
    assert len(table.shapes()) == 4
    first = table.shapes()[0]
    for later in table.shapes():
        assert later.version == first.version == 1
        assert later.shapes == first.shapes
    assert {state.version for state in table.states()} == {1}
    headers = [message.header.sequence for message in table.seen]
    assert headers == sorted(set(headers))


def test_a_slow_video_link_delays_frames_and_never_a_stiffness() -> None:
    free, slow = Table(), Table(link=LinkSpec.parse("video: rate 2mbit"))
    for table in (free, slow):
        table.watch(**ALL)
        table.run(4.0)
    assert slow.ages_s["haptics"] == free.ages_s["haptics"]
    assert slow.ages_s["telemetry"] == free.ages_s["telemetry"]
    # 18 kB at 2 Mbit/s take 73 ms; at most one waits behind another, as no more are made meanwhile.
    assert min(slow.ages_s["video"]) >= 0.072
    assert max(slow.ages_s["video"]) < 0.25
    assert 10 * 4 <= len(slow.frames()) <= 14 * 4
    assert {frame.view for frame in slow.frames()[-4:]} == {"overview", "first_person"}
    assert slow.looking.summary()["overview"]["behind"] > 50


def test_pictures_give_way_to_a_narrow_link_and_come_back() -> None:
    table = Table(left_bit_s=150e3)
    table.watch(overview=True, first_person=True)
    table.run(4.0)
    assert table.looking.pictures == {"rate_hz": 5.0, "quality": 30, "size": 0.5}
    assert 2 * 4 * 4 <= len(table.frames()) <= 2 * 5 * 4 + 4
    assert {(frame.width, frame.height) for frame in table.frames()[4:]} == {(320, 240)}
    table.left_bit_s, table.begins = 1e9, True
    table.run(4.0)
    assert table.looking.pictures == {"rate_hz": 30.0, "quality": 75, "size": 1.0}
    last = table.frames()[-50:]
    assert {(frame.width, frame.height) for frame in last} == {(640, 480)}


def test_the_slowest_viewer_decides_rate_and_size_of_pictures_and_the_scenes_rate() -> None:
    table = Table()
    table.watch(**ALL, picture_hz=10.0, halved=True, scene_hz=5.0)
    table.run(4.0)
    assert table.looking.pictures == {"rate_hz": 10.0, "quality": 75, "size": 0.5}
    views = Counter(frame.view for frame in table.frames())
    assert all(38 <= count <= 41 for count in views.values())
    assert 18 <= len(table.states()) <= 21
    assert {(frame.width, frame.height) for frame in table.frames()} == {(320, 240)}
    table.watch(**ALL)
    table.run(3.0)
    assert table.looking.pictures == {"rate_hz": 30.0, "quality": 75, "size": 1.0}


def test_what_is_recorded_keeps_its_own_rate_and_size_beside_a_late_page() -> None:
    table = Table(always=tuple(ALL))
    table.watch(**ALL, picture_hz=5.0, halved=True, scene_hz=5.0)
    table.run(3.0)
    assert table.looking.pictures == {"rate_hz": 30.0, "quality": 75, "size": 1.0}
    views = Counter(frame.view for frame in table.frames())
    assert all(80 <= count <= 91 for count in views.values())
    assert len(table.states()) >= 80
    assert {(frame.width, frame.height) for frame in table.frames()} == {(640, 480)}


def test_the_same_link_shows_whole_size_in_h264_and_another_codec_begins_where_its_bytes_say() -> None:
    table = Table(left_bit_s=150e3, link=LinkSpec.parse("video: rate 150kbit"))
    table.watch(overview=True, first_person=True, lacks=(0, 0))
    table.run(8.0)
    seen = table.looking.pictures
    assert seen is not None
    assert (seen["quality"], seen["size"]) == (75, 1.0)
    for view in ("overview", "first_person"):
        steps = [step for step in table.steps() if step.view == view]
        assert [step.number for step in steps] == list(range(1, len(steps) + 1))
        assert [step.number for step in steps if step.whole] == [1]
        assert len(steps) >= 5 * 6
    assert table.frames() == []
    # Whole ones of both views are under way for 1.2 s; then no step waits long.
    assert max(table.ages_s["video"][10:]) < 0.25
    # A viewer that shows only JPEG begins to look.
    table.watch(overview=True, first_person=True)
    table.run(1.0)
    assert table.looking.pictures == {"rate_hz": 5.0, "quality": 30, "size": 0.5}


@pytest.mark.parametrize("law", ["swept", "paper"])
def test_a_state_says_where_the_robot_side_believes_everything_is(law: str) -> None:
    camera = CameraSettings(mean_m=(0.01, -0.02, 0.005), sd_m=0.004)
    table = Table(RobotSettings(camera=camera, law=law))
    table.watch(scene=True)
    table.run(0.5)
    state, [shapes] = table.states()[-1], table.shapes()
    scene, kinematics = table.parts.scene, table.parts.kinematics
    assert table.robot.newest is not None
    _, situation = table.robot.newest
    objects = situation.objects
    assert objects.positions_m is not None
    # Links where the encoders say, objects where the camera does: each with its own error.
    bodies = np.array([scene.model.body(name).id for name in shapes.links])
    links = rows(state.link_poses, 7)
    np.testing.assert_allclose(links[:, :3], kinematics.body_poses(bodies)[:, :3], atol=2e-4)
    np.testing.assert_allclose(links[:, :3], scene.data.xpos[bodies], atol=2e-3)
    assert list(np.frombuffer(state.object_index, "<u4")) == list(range(len(shapes.objects)))
    poses = rows(state.object_poses, 7)
    np.testing.assert_allclose(poses[:, :3], objects.positions_m, atol=1e-6)
    for index, thing in enumerate(scene.objects):
        true_m = scene.data.geom_xpos[thing.geoms[0]]
        assert thing.name == shapes.objects[index]
        assert np.linalg.norm(poses[index, :3] - true_m) > 0.01
        turned = Rotation.from_quat(poses[index, 3:], scalar_first=True).as_matrix()
        np.testing.assert_allclose(turned, scene.data.geom_xmat[thing.geoms[0]].reshape(3, 3), atol=1e-5)
    target = shapes.objects.index("target")
    assert [index for index, role in enumerate(state.roles) if role == 1] == [target]
    assert rows(state.spheres, 4).shape == (len(situation.pose.sphere_radii_m), 4)
    assert state.tool_pose[:3] == pytest.approx(situation.pose.tool_position_m, abs=2e-4)
    for terms in (state.l2, state.r2):
        assert terms.camera_sd_m == pytest.approx(0.004)
        assert terms.quantile == pytest.approx(2.3263, abs=1e-3)
        variance = terms.kinematic_sd_m**2 + terms.camera_sd_m**2 + terms.prediction_sd_m**2
        assert terms.sigma_m == pytest.approx(terms.mean_m + terms.quantile * np.sqrt(variance), rel=1e-9)
    if law == "swept":
        # û·(μ_ee - μ_c) along ±x, and the same μ_δ.
        assert state.l2.mean_m - state.r2.mean_m == pytest.approx(0.02, abs=1e-4)


@pytest.mark.parametrize("law", ["swept", "paper"])
def test_overlaps_add_up_to_the_figure_of_the_run_under_any_law(law: str) -> None:
    table = Table(RobotSettings(camera=CameraSettings(mean_m=-0.01), law=law, permit_tuning=True))
    table.run(0.1)
    core, parts = table.robot, table.parts
    assert core.newest is not None
    sensed, situation = core.newest
    # Among objects, with a known delay, moving: something is met within a tenth of a second.
    pose = situation.pose
    there = replace(pose, sphere_centers_m=pose.sphere_centers_m + np.array([0.2, 0.02, -0.17]))
    velocities = np.linalg.pinv(pose.tool_jacobian) @ [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]
    moving = replace(situation, pose=there, loop_age_known=True, loop_age_s=0.3, joint_velocities_rad_s=velocities)
    total_m3 = parts.enlarged.overlap_m3(moving)
    l2_m3, r2_m3 = parts.enlarged.overlaps_m3("l2", moving), parts.enlarged.overlaps_m3("r2", moving)
    assert total_m3 > 1e-6
    assert len(r2_m3) > 1
    assert sum(r2_m3.values()) == pytest.approx(total_m3, rel=1e-9)
    # Another P reaches the law and the figure.
    assert parts.session.tuning.grant(Tune(table.end.stamp(0.2), 1, probability=0.6), 0.2, owns=True)
    assert parts.enlarged.overlap_m3(moving) < 0.9 * total_m3
    sensed = parts.law.sense(moving, 10.0)
    l2, r2 = (parts.explains.explain(trigger, moving, sensed) for trigger in ("l2", "r2"))
    assert r2.quantile == pytest.approx(NormalDist().inv_cdf(0.6))
    assert r2.displacement_m == pytest.approx(0.03, rel=1e-3)
    if law == "swept":
        assert sum(l2_m3.values()) != pytest.approx(total_m3, rel=1e-3)
        assert max(r2.sigma_m, l2.sigma_m) > 0.0
