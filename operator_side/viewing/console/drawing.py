"""Drawing of the robot side's scene in viser.

It has the robot as the robot side estimates it, the objects as perceived, and the gripper's spheres moved ahead by
each trigger's distance D. Only changes are sent to the browser: one batch of poses for all shapes that share a mesh.
"""

from typing import Any, Final, NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray
from viser.transforms import SO3

from common.protocol.view_messages import SceneShapes, SceneState, Shape
from common.roles import ROLES, Role
from operator_side.viewing.console.solids import Solid, box, solid_of, sphere

Floats = NDArray[np.float64]
"""Array of float64; a pose is a row of x, y, z and the quaternion w, x, y, z"""

L2_COLOR: Final = (0, 114, 189)
R2_COLOR: Final = (230, 130, 0)
"""Blue and orange, which the colour-blind can tell apart; style.css has the same colours"""
_HALF_TINTED_M3: Final = 2e-6
"""Overlap, in cubic metres, at which an object's colour is half its own and half the trigger's"""
_GHOST_OPACITY: Final = 0.16
_SEEN_FROM_M: Final = (0.42, -0.5, 0.34)
"""First camera position, relative to the tool"""
_LIGHT_FROM: Final = (0.4, -1.0, 1.5)
_FIELD_OF_VIEW: Final = 0.9
"""First camera's vertical angle of view, in radians"""
_STILL: Final = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
_KINDS_OF_OWN_MESHES: Final = ("mesh", "capsule")
_MOST_MESHES: Final = 2000
"""Maximum number of meshes from which on capsules and meshes are no longer drawn: each takes milliseconds"""
_GONE: Final = 1e-6
"""Scale that makes a shape invisible"""
_SURFACES_ROOM: Final = 256
"""Surfaces by which a batch grows, so that it is seldom made anew"""
_SURFACE_COLORS: Final = {
    Role.OBSTACLE: (130, 130, 140),
    Role.TARGET: (204, 121, 167),
    Role.SUPPORT: (190, 178, 150),
    Role.IGNORED: (215, 215, 215),
}


def compose(outer: Floats, inner: Floats) -> Floats:
    """Compose poses (n, 7): `inner` is given in the frame `outer`; return it in the frame in which `outer` is given."""
    turn, inner_turn = (SO3(poses[:, 3:]) for poses in (outer, inner))
    turns = (turn @ inner_turn).normalize().wxyz
    return np.concatenate([outer[:, :3] + turn.apply(inner[:, :3]), turns], axis=1)


def _add(scene: viser.SceneApi, name: str, solid: Solid, places: Any, **looks: Any) -> viser.BatchedMeshHandle:
    """Draw n copies of a solid, unrotated, at the positions `places` (n, 3)."""
    return scene.add_batched_meshes_simple(
        name,
        solid.vertices,
        solid.triangles,
        batched_wxyzs=np.tile(np.array([1.0, 0.0, 0.0, 0.0]), (len(places), 1)),
        batched_positions=places,
        flat_shading=solid.flat,
        lod="off",
        cast_shadow=False,
        receive_shadow=False,
        **looks,
    )


class _Batch:
    """Shapes that share a mesh and are drawn as one batch."""

    def __init__(self, scene: viser.SceneApi, name: str, solid: Solid, members: list[tuple[Shape, Any]]) -> None:
        shapes = [shape for shape, _ in members]
        self.of_robot = np.array([shape.of_robot for shape in shapes])
        self.owner = np.array([shape.owner for shape in shapes])
        self._inner = np.array([shape.pose for shape in shapes], np.float64)
        self._own_colors = 255.0 * np.array([shape.color[:3] for shape in shapes])
        """As in the cameras' pictures"""
        self._colors = self._own_colors.astype(np.uint8)
        places, scales = np.zeros((len(members), 3)), np.array([scale for _, scale in members])
        self._handle = _add(scene, name, solid, places, batched_scales=scales, batched_colors=self._colors)
        self._poses = np.full((len(members), 7), np.nan, np.float32)

    def move(self, links: Floats, objects: Floats, tints: "_Tints") -> None:
        """Move and colour the shapes. links, objects: poses (n, 7) of the robot's links and of the objects."""
        outer = np.empty((len(self.owner), 7))
        outer[self.of_robot] = links[self.owner[self.of_robot]]
        outer[~self.of_robot] = objects[self.owner[~self.of_robot]]
        poses = compose(outer, self._inner).astype(np.float32)
        if not np.array_equal(poses[:, :3], self._poses[:, :3]):
            self._handle.batched_positions = poses[:, :3]
        if not np.array_equal(poses[:, 3:], self._poses[:, 3:]):
            self._handle.batched_wxyzs = poses[:, 3:]
        self._poses = poses
        mixed, owner = self._own_colors.copy(), self.owner[~self.of_robot]
        mixed[~self.of_robot] += tints.shares[owner] * (tints.colors[owner] - mixed[~self.of_robot])
        colors = mixed.astype(np.uint8)
        if not np.array_equal(colors, self._colors):
            self._colors = colors
            self._handle.batched_colors = colors

    def remove(self) -> None:
        self._handle.remove()


class _Ghost:
    """Enlarged spheres of the gripper, moved ahead by the distance D of one trigger."""

    def __init__(self, scene: viser.SceneApi, name: str, color: tuple[int, int, int]) -> None:
        self._scene, self._name, self._color = scene, name, color
        self._handle: viser.BatchedMeshHandle | None = None
        self._count = 0
        self._radii: NDArray[np.float32] = np.zeros(0, np.float32)

    def draw(self, spheres: NDArray[np.float32], moved_m: Floats | None, inflated_m: float) -> None:
        """Draw spheres (m, 4), moved by `moved_m` (3,), radii grown by `inflated_m`; `moved_m` None hides them."""
        moved: NDArray[np.float32] = (spheres[:, :3] + (0.0 if moved_m is None else moved_m)).astype(np.float32)
        radii = np.full(len(spheres), _GONE, np.float32) if moved_m is None else spheres[:, 3] + np.float32(inflated_m)
        if self._handle is None or self._count != len(spheres):
            if self._handle is not None:
                self._handle.remove()
            self._count = len(spheres)
            looks = {"batched_scales": radii, "batched_colors": self._color, "opacity": _GHOST_OPACITY}
            self._handle = _add(self._scene, self._name, sphere(1), moved, **looks)
        else:
            self._handle.batched_positions = moved
            if not np.array_equal(radii, self._radii):
                self._handle.batched_scales = radii
        self._radii = radii


class _Surfaces:
    """Boxes that depth cameras see, coloured by their roles."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._handle: viser.BatchedMeshHandle | None = None
        self._room = 0

    def draw(self, state: SceneState) -> None:
        """Draw the surfaces of a state; those of an earlier one stay if it has none."""
        if state.surfaces is None:
            return
        rows = np.frombuffer(state.surfaces, np.float32).reshape(-1, 10)
        roles = np.minimum(np.frombuffer(state.surface_roles, np.uint8), len(ROLES) - 1)
        if self._handle is None or self._room < len(rows):
            if self._handle is not None:
                self._handle.remove()
            self._room = _SURFACES_ROOM * max(1, -(-len(rows) // _SURFACES_ROOM))
            looks = {
                "batched_scales": np.full(self._room, _GONE),
                "batched_colors": np.zeros((self._room, 3), np.uint8),
            }
            self._handle = _add(self._scene, "/surfaces", box(), np.zeros((self._room, 3)), **looks)
        drawn = np.tile(np.array((*_STILL, _GONE, _GONE, _GONE), np.float32), (self._room, 1))
        drawn[: len(rows)] = rows
        colors = np.zeros((self._room, 3), np.uint8)
        colors[: len(rows)] = np.array([_SURFACE_COLORS[role] for role in ROLES], np.uint8)[roles]
        self._handle.batched_positions, self._handle.batched_wxyzs = drawn[:, :3], drawn[:, 3:7]
        self._handle.batched_scales, self._handle.batched_colors = drawn[:, 7:], colors


class Drawing:
    """The newest scene, drawn in viser."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._shapes: SceneShapes | None = None
        self._batches: list[_Batch] = []
        self._objects: Floats = np.zeros((0, 7))
        self._surfaces = _Surfaces(server.scene)
        self._label: viser.LabelHandle | None = None
        self._looked = False
        self._ghosts = (
            _Ghost(server.scene, "/felt by L2", L2_COLOR),
            _Ghost(server.scene, "/felt by R2", R2_COLOR),
        )
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.scene.configure_default_lights(enabled=False)
        server.scene.configure_environment_map(None)
        server.scene.add_light_ambient("/light", intensity=0.9)
        server.scene.add_light_directional("/light from above", intensity=1.3, position=_LIGHT_FROM)

    def shapes(self, shapes: SceneShapes) -> None:
        """Build the shapes, unless shapes of the same version are built already."""
        if self._shapes is not None and self._shapes.version == shapes.version:
            return
        for batch in self._batches:
            batch.remove()
        self._shapes, self._looked = shapes, False
        self._objects = np.tile(np.array(_STILL), (len(shapes.objects), 1))
        alike: dict[Any, tuple[Solid, list[tuple[Shape, Any]]]] = {}
        for shape in shapes.shapes:
            own = shape.kind in _KINDS_OF_OWN_MESHES and len(alike) >= _MOST_MESHES
            if shape.owner < len(shapes.links if shape.of_robot else shapes.objects) and not own:
                key, solid, scale = solid_of(shape)
                alike.setdefault(key, (solid, []))[1].append((shape, scale))
        self._batches = [
            _Batch(self._server.scene, f"/scene/{number}", solid, members)
            for number, (solid, members) in enumerate(alike.values())
        ]

    def state(self, state: SceneState, needed_m: tuple[float | None, float | None], advancing: str) -> None:
        """Move and colour everything; ignore a state whose version is not that of the built shapes.

        needed_m: distance D of L2 and of R2; None hides the ghost. advancing: "L2" or "R2".
        """
        shapes = self._shapes
        if shapes is None or shapes.version != state.version:
            return
        links = np.frombuffer(state.link_poses, np.float32).reshape(-1, 7).astype(np.float64)
        index = np.frombuffer(state.object_index, np.uint32)
        if len(links) != len(shapes.links) or (len(index) and index.max() >= len(self._objects)):
            return
        self._objects[index] = np.frombuffer(state.object_poses, np.float32).reshape(-1, 7)
        roles = np.zeros(len(shapes.objects), np.uint8)
        roles_sent = np.frombuffer(state.roles, np.uint8)[: len(roles)]
        roles[: len(roles_sent)] = np.minimum(roles_sent, len(ROLES) - 1)
        tints = _tints(len(roles), state)
        with self._server.atomic():
            for batch in self._batches:
                batch.move(links, self._objects, tints)
            self._surfaces.draw(state)
            self._place_label(shapes, roles)
            spheres = np.frombuffer(state.spheres, np.float32).reshape(-1, 4)
            along: Floats = SO3(np.array(state.tool_pose[3:])).apply(np.array([0.0, 0.0, 1.0])).astype(np.float64)
            for ghost, name, ahead_m, terms in zip(
                self._ghosts, ("L2", "R2"), needed_m, (state.l2, state.r2), strict=True
            ):
                sign = 1.0 if name == advancing else -1.0
                ghost.draw(spheres, None if ahead_m is None else sign * ahead_m * along, terms.sigma_m)
        if not self._looked:
            self._looked = True
            tool = np.array(state.tool_pose[:3])
            self._server.initial_camera.look_at = tool
            self._server.initial_camera.position = tool + np.array(_SEEN_FROM_M)
            self._server.initial_camera.fov = _FIELD_OF_VIEW

    def _place_label(self, shapes: SceneShapes, roles: NDArray[np.uint8]) -> None:
        targets = np.flatnonzero(roles == ROLES.index(Role.TARGET))
        if len(targets) == 0:
            if self._label is not None:
                self._label.visible = False
            return
        index, text = int(targets[0]), f"target: {shapes.objects[targets[0]]}"
        # At the centre of the object's first shape: the origin of the object's frame may be far from its surface.
        pose = next((shape.pose for shape in shapes.shapes if shape.owner == index and not shape.of_robot), _STILL)
        position = compose(self._objects[index : index + 1], np.array([pose]))[0, :3]
        if self._label is None:
            self._label = self._server.scene.add_label("/target", text, position=position, anchor="bottom-center")
        elif self._label.text != text or not np.array_equal(self._label.position, position):
            self._label.text, self._label.position, self._label.visible = text, position, True


class _Tints(NamedTuple):
    """Colours that the objects turn towards, by the overlap that a trigger causes."""

    shares: Floats
    """(n, 1) 0 to 1"""
    colors: Floats
    """(n, 3)"""


def _tints(count: int, state: SceneState) -> _Tints:
    """Compute the tints of `count` objects: towards the colour of the trigger with more overlap."""
    shares, colors = np.zeros((count, 1)), np.zeros((count, 3))
    for index, by_l2_m3, by_r2_m3 in state.overlaps:
        if 0 <= index < count:
            strongest_m3 = max(by_l2_m3, by_r2_m3)
            shares[index] = strongest_m3 / (strongest_m3 + _HALF_TINTED_M3) if strongest_m3 > 0.0 else 0.0
            colors[index] = L2_COLOR if by_l2_m3 > by_r2_m3 else R2_COLOR
    return _Tints(shares, colors)
