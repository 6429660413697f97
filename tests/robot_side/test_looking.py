"""What is made for whoever looks, in virtual time: how much, when, and what it says."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.emulation.delay_line import DelayLine
from common.emulation.spec import LinkSpec
from common.protocol.codec import decode, decode_view, encode
from common.protocol.link_end import LinkEnd
from common.protocol.messages import StiffnessUpdate, Watch
from common.protocol.view_messages import SceneShapes, SceneState, VideoFrame
from robot_side.assembly import Assembled, assemble
from robot_side.cameras.shapes import SceneModel
from robot_side.looking import Looking
from robot_side.outgoing_messages import Outgoing, OutgoingStream
from robot_side.scene_view import SceneView
from robot_side.settings import CameraSettings, RobotSettings
from tests.helpers.fake_companion import Desk

TICK_S = 0.001
ALL = {"overview": True, "first_person": True, "scene": True}


_tables: list["Table"] = []


@pytest.fixture(autouse=True)
def _cleared_away() -> Iterator[None]:
    yield
    while _tables:
        _tables.pop().desk.close()


@dataclass
class Table:
    """A robot side with an operator who looks, as the loop drives it; a companion answers after 4 ms."""

    settings: RobotSettings = field(default_factory=RobotSettings)
    link: LinkSpec = field(default_factory=LinkSpec)
    always: tuple[str, ...] = ()
    jpeg_bytes: int = 18_000

    def __post_init__(self) -> None:
        self.robot: Assembled = assemble(self.settings, 1, "clock")
        self.desk = Desk(self.robot.scene)
        self.lines: dict[str, DelayLine[Outgoing]] = {
            stream: DelayLine(self.link.profile("to_operator", stream))
            for stream in ("haptics", "telemetry", "video", "scene")
        }
        view = SceneView(SceneModel(self.robot.scene), self.robot.kinematics, self.robot.law)
        self.looking = Looking(self.robot.core, view, self.desk.cameras, self._backlog_s, always=self.always)
        self.end = LinkEnd("operator", 5, "clock")
        self.watching: dict[str, bool] = {}
        self.ticks = 0
        self.ages_s: dict[str, list[float]] = {stream: [] for stream in self.lines}
        self.seen: list[VideoFrame | SceneShapes | SceneState] = []
        self._sent_s: dict[int, float] = {}
        self._orders: list[tuple[float, object]] = []
        self.hear(encode(self.end.hello(0.0)))

        _tables.append(self)

    def _backlog_s(self, stream: OutgoingStream, now_s: float) -> float:
        return self.lines[stream].backlog_s(now_s)

    @property
    def now_s(self) -> float:
        return self.ticks * TICK_S

    def hear(self, payload: bytes) -> None:
        self.robot.core.receive(b"peer", payload, self.now_s)

    def watch(self, **what: bool) -> None:
        self.watching = what

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.ticks += 1
            if self.watching and self.ticks % 250 == 1:
                self.hear(encode(Watch(self.end.stamp(self.now_s), **self.watching)))
            if self.ticks % 100 == 0:
                self.hear(encode(self.end.hello(self.now_s)))
            self._push(self.robot.core.tick(self.now_s))
            self._push(self.looking.idle(self.now_s, self.now_s))
            self._render()
            for stream, line in self.lines.items():
                for message in line.pop(self.now_s):
                    self.ages_s[stream].append(self.now_s - self._sent_s.pop(id(message)))
                    if stream in ("video", "scene"):
                        self.seen.append(decode_view(message.payload))

    def _push(self, messages: list[Outgoing]) -> None:
        for message in messages:
            if message.stream == "haptics" and not isinstance(decode(message.payload), StiffnessUpdate):
                continue
            self._sent_s[id(message)] = self.now_s
            self.lines[message.stream].push(self.now_s, message, len(message.payload))

    def _render(self) -> None:
        for companion in self.desk.companions:
            if companion.running:
                self._orders += [(self.now_s + 0.004, order) for order in self.desk.orders()]
        while self._orders and self._orders[0][0] <= self.now_s:
            order = self._orders.pop(0)[1]
            self.desk.companions[-1].picture(order, bytes(self.jpeg_bytes))  # type: ignore[arg-type]

    def frames(self) -> list[VideoFrame]:
        return [message for message in self.seen if isinstance(message, VideoFrame)]

    def states(self) -> list[SceneState]:
        return [message for message in self.seen if isinstance(message, SceneState)]

    def shapes(self) -> list[SceneShapes]:
        return [message for message in self.seen if isinstance(message, SceneShapes)]


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


def test_what_is_looked_at_comes_thirty_times_a_second_and_ends_a_second_after_the_last_watch() -> None:
    table = Table()
    table.watch(**ALL)
    table.run(3.0)
    views = Counter(frame.view for frame in table.frames())
    assert all(80 <= views[view] <= 90 for view in ("overview", "first_person"))
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
    assert 3.6 < newest_s < 3.8  # the last Watch came at 2.75 s


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


def test_a_recording_gets_the_scene_although_nobody_looks() -> None:
    table = Table(always=("scene",))
    table.run(2.0)
    assert 55 <= len(table.states()) <= 61
    assert len(table.shapes()) == 1
    assert table.frames() == []


def test_a_slow_video_link_delays_frames_and_never_a_stiffness() -> None:
    free, slow = Table(), Table(link=LinkSpec.parse("video: rate 2mbit"))
    for table in (free, slow):
        table.watch(**ALL)
        table.run(4.0)
    assert slow.ages_s["haptics"] == free.ages_s["haptics"]
    assert slow.ages_s["telemetry"] == free.ages_s["telemetry"]
    # 18 kB at 2 Mbit/s are 73 ms; what waits behind one other is the most, as nothing more is made meanwhile.
    assert min(slow.ages_s["video"]) >= 0.072
    assert max(slow.ages_s["video"]) < 0.25
    assert 10 * 4 <= len(slow.frames()) <= 14 * 4
    assert {frame.view for frame in slow.frames()[-4:]} == {"overview", "first_person"}
    assert slow.looking.summary()["overview"]["behind"] > 50


@pytest.mark.parametrize("law", ["swept", "paper"])
def test_a_state_says_where_the_robot_side_believes_everything_is(law: str) -> None:
    camera = CameraSettings(mean_m=(0.01, -0.02, 0.005), sd_m=0.004)
    table = Table(RobotSettings(camera=camera, law=law))  # type: ignore[arg-type]
    table.watch(scene=True)
    table.run(0.5)
    state, [shapes] = table.states()[-1], table.shapes()
    scene, kinematics = table.robot.scene, table.robot.kinematics
    assert table.robot.core.newest is not None
    _, situation = table.robot.core.newest
    objects = situation.objects
    assert objects.positions_m is not None
    # Links where the encoders say, objects where the camera does: each is wrong by its own error.
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
def test_overlaps_add_up_to_the_total_that_the_law_has(law: str) -> None:
    table = Table(RobotSettings(camera=CameraSettings(mean_m=-0.01), law=law))  # type: ignore[arg-type]
    table.run(0.1)
    core = table.robot.core
    assert core.newest is not None
    sensed, situation = core.newest
    # Among things, with a delay that is known, moving: a tenth of a second's way ahead something is met.
    pose = situation.pose
    there = replace(pose, sphere_centers_m=pose.sphere_centers_m + np.array([0.2, 0.02, -0.17]))
    velocities = np.linalg.pinv(pose.tool_jacobian) @ [0.1, 0.0, 0.0, 0.0, 0.0, 0.0]
    moving = replace(situation, pose=there, loop_age_known=True, loop_age_s=0.3, joint_velocities_rad_s=velocities)
    law_anew = assemble(table.settings, 1, "clock").law
    sensed = law_anew.sense(moving, 10.0)
    assert sensed.overlap_m3 > 1e-6
    l2, r2 = law_anew.explain("l2", moving, sensed), law_anew.explain("r2", moving, sensed)
    assert len(r2.overlaps_m3) > 1
    assert sum(r2.overlaps_m3.values()) == pytest.approx(sensed.overlap_m3, rel=1e-6)
    assert r2.terms.displacement_m == pytest.approx(0.03, rel=1e-3)
    if law == "swept":
        assert sum(l2.overlaps_m3.values()) != pytest.approx(sensed.overlap_m3, rel=1e-3)
        assert max(r2.terms.sigma_m, l2.terms.sigma_m) > 0.0
