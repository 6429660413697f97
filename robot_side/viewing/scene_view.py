"""Messages with the perceived scene for viewers: shapes, poses and the law's results."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray, IntArray
from common.protocol.codec import VIEW_MAXIMUM_BYTES, Prepared
from common.protocol.messages import Header
from common.protocol.view_messages import EnlargementTerms, Eye, Near, SceneShapes, SceneState, Shape, ViewName
from common.roles import ROLES, Role
from robot_side.drivers.mujoco.kinematics import MujocoKinematics
from robot_side.surroundings.perceived import PerceivedObjects
from robot_side.surroundings.perceived_distances import perceived_distances
from robot_side.surroundings.surroundings import Surroundings
from robot_side.tick.explained import Explains, Overlapping, Overlaps, Trigger
from robot_side.tick.outgoing import SHOWN_NAME
from robot_side.tick.sensed import Sensed
from robot_side.tick.situation import Situation
from robot_side.viewing.shapes import SceneModel, bytes_of
from robot_side.viewing.surfaces import seen_surfaces

_TRIGGERS: Final[tuple[Trigger, Trigger]] = ("l2", "r2")
_FEW: Final = 64
"""Maximum number of objects for which every SceneState has all poses, even those of objects at rest"""
_STANDS_M: Final = 1e-6
_MOST_SHAPES_BYTES: Final = VIEW_MAXIMUM_BYTES - 65536
_ENTRY_BYTES: Final = 40
"""Bytes of an object in a message, besides its name and its shapes"""
_SHAPES_AT_ONCE: Final = 16
_OVERLAPS_PERIOD_S: Final = 0.1 - 1e-9
_SURFACES_PERIOD_S: Final = 1.0 - 1e-9
SURFACES_BYTES_PER_S: Final = 50_000.0
"""Most bytes of surfaces in a second"""


@dataclass
class TickFigures:
    """Durations of the latest ticks, and the number of missed deadlines."""

    p50_us: float = 0.0
    p99_us: float = 0.0
    overruns: int = 0


@dataclass
class _Begun:
    """Content of a SceneState that is being made."""

    sensed: Sensed
    situation: Situation
    taken_s: float
    version: int
    link_poses: bytes
    object_index: IntArray
    object_poses: bytes
    surfaces: tuple[bytes | None, bytes] = None, b""
    terms: dict[Trigger, EnlargementTerms] = field(default_factory=dict)
    overlaps_m3: dict[Trigger, Overlaps] = field(default_factory=dict)


class SceneView:
    """Maker of the messages SceneShapes and SceneState. Shapes stay the same until `begin_shapes` is called."""

    def __init__(
        self,
        model: SceneModel,
        kinematics: MujocoKinematics,
        law: Explains,
        enlarged: Overlapping,
        surroundings: Surroundings,
        eye: Eye | None = None,
        overview_eye: Eye | None = None,
    ) -> None:
        """eye, overview_eye: viewpoints as in SceneShapes."""
        self.version = 0
        self.shapes: Prepared | None = None
        """Newest finished SceneShapes message; None before `work_on_shapes` has finished the first"""
        self.shapes_bytes = 0
        self.left_out = 0
        self._model = model
        self._kinematics = kinematics
        self._law, self._enlarged = law, enlarged
        self._overlaps_m3: dict[Trigger, Overlaps] = {}
        """Newest overlaps along each trigger, which several messages tell"""
        self._next_overlaps_s = self._next_surfaces_s = -math.inf
        self._surfaces_bytes_per_s = SURFACES_BYTES_PER_S
        self._surroundings = surroundings
        self._eyes: dict[ViewName, Eye | None] = {"first_person": eye, "overview": overview_eye}
        self._links: tuple[tuple[Shape, ...], int] | None = None
        self._base: PerceivedObjects | None = None
        """Objects as they were when the shapes were made"""
        self._making: Iterator[None] | None = None
        self._begun: _Begun | None = None

    @property
    def complete(self) -> bool:
        """Whether the shapes are finished and include all objects"""
        return self.shapes is not None and self.left_out == 0

    def outdated(self, objects: PerceivedObjects) -> bool:
        """Return whether this frame has other objects or shapes than the frame before."""
        if outdated := self._model.update(objects):
            self._next_overlaps_s = -math.inf
        return outdated

    def look_from(self, eyes: Mapping[ViewName, Eye | None]) -> bool:
        """Take viewpoints, which replace those of the same views; return whether the shapes are outdated by them."""
        before, self._eyes = self._eyes, {**self._eyes, **eyes}
        return self._eyes != before

    def begin_shapes(self, header: Header, situation: Situation) -> None:
        """Begin to make SceneShapes anew, with the objects nearest to the tool first."""
        self._making = self._make_shapes(header, situation.objects, situation.pose.tool_position_m)

    def work_on_shapes(self) -> bool:
        """Continue to make the shapes for about a millisecond; return whether they are finished."""
        if self._making is None:
            return self.shapes is not None
        for _ in range(_SHAPES_AT_ONCE):
            if next(self._making, self) is self:
                self._making = None
                return True
        return False

    def begin_state(
        self,
        sensed: Sensed,
        situation: Situation,
        taken_s: float,
        surfaces_bytes_per_s: float = SURFACES_BYTES_PER_S,
    ) -> None:
        """Begin a SceneState of the newest tick, which was at `taken_s` with the results `sensed` and `situation`."""
        links = _row_bytes(self._kinematics.body_poses(self._model.bodies))
        index, first = self._moved(situation.objects), self._model.surfaces
        poses = object_poses(situation.objects, first + index)
        self._begun = _Begun(sensed, situation, taken_s, self.version, links, index, _row_bytes(poses))
        self._surfaces_bytes_per_s = surfaces_bytes_per_s
        if taken_s < self._next_overlaps_s:
            self._begun.overlaps_m3.update(self._overlaps_m3)
        else:
            self._next_overlaps_s = taken_s + _OVERLAPS_PERIOD_S

    def work_on_state(self, header: Callable[[], Header], ticks: TickFigures) -> SceneState | None:
        """Continue to make the SceneState for about 500 µs: return None after each piece of work, at last the message.

        Overlaps are worked out ten times a second.
        """
        begun = self._begun
        if begun is None:
            return None
        if self._model.surfaces and begun.taken_s >= self._next_surfaces_s:
            begun.surfaces = seen, roles = seen_surfaces(begun.situation.objects, self._model.surfaces)
            period_s = max(_SURFACES_PERIOD_S, (len(seen) + len(roles)) / self._surfaces_bytes_per_s)
            self._next_surfaces_s = begun.taken_s + period_s
            return None
        for trigger in _TRIGGERS:
            if trigger not in begun.terms:
                begun.terms[trigger] = self._law.explain(trigger, begun.situation, begun.sensed)
                return None
            if trigger not in begun.overlaps_m3:
                # Where there was too much to look at, its volumes would take too long, too.
                known = not begun.sensed.cut
                begun.overlaps_m3[trigger] = self._enlarged.overlaps_m3(trigger, begun.situation) if known else {}
                return None
        self._begun, self._overlaps_m3 = None, begun.overlaps_m3
        return self._state(header(), begun, ticks)

    def _state(self, header: Header, begun: "_Begun", ticks: TickFigures) -> SceneState:
        objects, pose = begun.situation.objects, begun.situation.pose
        l2_m3, r2_m3, first = begun.overlaps_m3["l2"], begun.overlaps_m3["r2"], self._model.surfaces
        l2_seen_m3, r2_seen_m3 = (sum(m3 for k, m3 in side.items() if k < first) for side in (l2_m3, r2_m3))
        surfaces = ((len(objects.names) - first, l2_seen_m3, r2_seen_m3),) if l2_seen_m3 or r2_seen_m3 else ()
        return SceneState(
            header,
            version=begun.version,
            taken_s=begun.taken_s,
            link_poses=begun.link_poses,
            object_index=begun.object_index.astype("<u4").tobytes(),
            object_poses=begun.object_poses,
            roles=bytes(map(ROLES.index, objects.roles[first:])),
            tool_pose=_pose(pose.tool_position_m, pose.tool_rotation),
            spheres=_row_bytes(np.column_stack([pose.sphere_centers_m, pose.sphere_radii_m])),
            overlaps=tuple(
                (thing - first, l2_m3.get(thing, 0.0), r2_m3.get(thing, 0.0))
                for thing in sorted(l2_m3.keys() | r2_m3.keys())
                if thing >= first
            )
            + surfaces,
            l2=begun.terms["l2"],
            r2=begun.terms["r2"],
            tick_p50_us=ticks.p50_us,
            tick_p99_us=ticks.p99_us,
            overruns=ticks.overruns,
            near=self._near(begun.situation),
            surfaces=begun.surfaces[0],
            surface_roles=begun.surfaces[1],
            unseen=None if objects.unknown is None else objects.unknown.shares,
        )

    def _near(self, situation: Situation) -> Near:
        objects, held = situation.objects, situation.held
        target = objects.roles.index(Role.TARGET) if Role.TARGET in objects.roles else None
        spheres = situation.pose.sphere_centers_m, situation.pose.sphere_radii_m
        apart = perceived_distances(*spheres, self._surroundings.see(objects), target, held)
        names = apart.nearest, None if held is None else objects.names[held]
        nearest, holding = (None if name is None else name[:SHOWN_NAME] for name in names)
        return Near(nearest, apart.nearest_m, apart.target_m, holding)

    def _moved(self, objects: PerceivedObjects) -> IntArray:
        """Return the indices of the objects whose poses must be sent."""
        count = len(objects.names) - self._model.surfaces
        if count <= _FEW or self._model.surfaces:
            return np.arange(count)
        if self._base is None:
            return self._model.may_move
        (positions_m, rotations), (at_first_m, turned_first) = _frames(objects), _frames(self._base)
        moved = np.abs(positions_m - at_first_m).max(axis=1) > _STANDS_M
        moved |= np.abs(rotations - turned_first).max(axis=(1, 2)) > _STANDS_M
        moved[self._model.may_move] = True
        return np.flatnonzero(moved)

    def _make_shapes(self, header: Header, objects: PerceivedObjects, tool_m: FloatArray) -> Iterator[None]:
        model = self._model
        links, room = self._links or ((), _MOST_SHAPES_BYTES)
        if self._links is None:
            made = []
            for shape in model.link_shapes():
                kept = shape if bytes_of(shape) <= room // 2 else _boxed(shape)
                made.append(kept)
                room -= bytes_of(kept)
                yield
            links = tuple(made)
            self._links = links, room
        poses = object_poses(objects, np.arange(model.surfaces, len(objects.names)))
        room -= sum(len(name) + _ENTRY_BYTES for name in model.objects)
        shapes, left_out = list(links), 0
        distances_m = np.linalg.norm(poses[:, :3] - tool_m, axis=1)
        for index in np.argsort(distances_m, kind="stable").tolist():
            mine = tuple(model.object_shapes(index))
            taken = sum(map(bytes_of, mine))
            if taken <= room:
                shapes += mine
                room -= taken
            else:
                left_out += 1
            yield
        self.version += 1
        self._base, self.left_out = objects, left_out
        eyes = self._eyes["first_person"], self._eyes["overview"]
        said = SceneShapes(
            header, self.version, model.links, model.objects, tuple(shapes), left_out, _row_bytes(poses), *eyes
        )
        self.shapes = Prepared(said)
        self.shapes_bytes = len(self.shapes.under(header))


def object_poses(objects: PerceivedObjects, index: IntArray) -> FloatArray:
    """Return the perceived poses (n, 7) of the objects `index` (n,): positions, then quaternions, w first.

    ValueError if the frame has no poses.
    """
    positions_m, rotations = _frames(objects)
    if index.size == 0:
        return np.empty((0, 7))
    turned = Rotation.from_matrix(rotations[index]).as_quat(scalar_first=True)
    return np.concatenate([positions_m[index], turned], axis=1)


def _frames(objects: PerceivedObjects) -> tuple[FloatArray, FloatArray]:
    if objects.positions_m is None or objects.rotations is None:
        raise ValueError("objects.positions_m is None; valid: objects of a camera that knows their poses")
    return objects.positions_m, objects.rotations


def _boxed(shape: Shape) -> Shape:
    """Return a box around a mesh that is too large for the message."""
    vertices_m = np.frombuffer(shape.vertices_m, "<f4").reshape(-1, 3).astype(np.float64)
    low, high = vertices_m.min(axis=0), vertices_m.max(axis=0)
    x, y, z, *quaternion = shape.pose
    rotation = Rotation.from_quat(quaternion, scalar_first=True)
    middle = np.array([x, y, z]) + rotation.apply(0.5 * (low + high))
    half_x, half_y, half_z = (0.5 * (high - low)).tolist()
    return Shape(
        *(shape.owner, shape.of_robot, "box", (half_x, half_y, half_z)),
        pose=_pose(middle, rotation.as_matrix()),
        color=shape.color,
    )


def _pose(position_m: FloatArray, rotation: FloatArray) -> tuple[float, float, float, float, float, float, float]:
    x, y, z = position_m.tolist()
    w, i, j, k = Rotation.from_matrix(rotation).as_quat(scalar_first=True).tolist()
    return (x, y, z, w, i, j, k)


def _row_bytes(rows: FloatArray) -> bytes:
    return rows.astype("<f4").tobytes()
