"""Cues that the page draws into the camera views: the target's outline, and the gripper's height as a line down."""

from typing import Any, Final

import numpy as np

from common.protocol.view_messages import Eye, SceneShapes, SceneState, Shape
from common.roles import ROLES, Role
from operator_side.viewing.console.outlines import Floats, corners_m, moved, outline, rotation, seen
from operator_side.viewing.console.seen_surfaces import SeenSurfaces
from operator_side.viewing.console.solids import solid_of

_STILL: Final = np.array((0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
_FLAT: Final = 1e-12


class _Body:
    """Triangles (t, 3, 3) of one object in its own frame, a sphere around them, and a box around each shape."""

    def __init__(self, shapes: list[Shape]) -> None:
        parts = []
        for shape in shapes:
            _, solid, scale = solid_of(shape)
            parts.append(moved(np.array(shape.pose), solid.vertices * np.array(scale))[solid.triangles])
        self.triangles: Floats = np.concatenate(parts)
        self.corners: Floats = np.concatenate([corners_m(shape) for shape in shapes])
        points = self.triangles.reshape(-1, 3)
        self.centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        self.radius_m = float(np.linalg.norm(points - self.centre, axis=1).max())

    def top_below_m(self, point: Floats, pose: Floats) -> float | None:
        """Return how far below a point the object's next upper side lies; None if none does."""
        to_body = rotation(pose).T
        start, down = to_body @ (point - pose[:3]), -to_body[:, 2]
        if np.linalg.norm(np.cross(self.centre - start, down)) > self.radius_m:
            return None
        first, second, third = self.triangles.swapaxes(0, 1)
        one, other = second - first, third - first
        across = np.cross(down, other)
        size = np.sum(one * across, axis=1)  # above 0 for a side that faces up
        faces = size > _FLAT
        one, other, across, size, before = one[faces], other[faces], across[faces], size[faces], (start - first)[faces]
        aside = np.cross(before, one)
        u, v, far = (np.sum(before * across, axis=1), aside @ down, np.sum(other * aside, axis=1)) / size
        met = far[(u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far >= 0.0)]
        return float(met.min()) if met.size else None

    def lowest_m(self, pose: Floats) -> float:
        """Return the height of the object's lowest point in the world frame."""
        return float(moved(pose, self.triangles.reshape(-1, 3))[:, 2].min())


class Cues:
    """Shapes and newest poses of the objects, and the cues that follow from them, as the robot side believes them."""

    def __init__(self) -> None:
        self._shapes: SceneShapes | None = None
        self._poses: Floats = np.zeros((0, 7))
        self._own: dict[int, list[Shape]] = {}
        self._bodies: dict[int, _Body] = {}
        self._surfaces = SeenSurfaces()

    def shapes(self, shapes: SceneShapes) -> None:
        """Take the shapes; their objects rest until a state moves them."""
        if self._shapes is None or self._shapes.version != shapes.version:
            self._poses = np.tile(_STILL, (len(shapes.objects), 1))
            if shapes.object_poses:
                self._poses[:] = np.frombuffer(shapes.object_poses, np.float32).reshape(-1, 7)
            self._own, self._bodies = {}, {}
            for shape in shapes.shapes:
                if not shape.of_robot and shape.owner < len(shapes.objects):
                    self._own.setdefault(shape.owner, []).append(shape)
        self._shapes = shapes

    def of(self, state: SceneState) -> dict[str, Any]:
        """Return the page's `target`, `drop` and `tool`, the gripper's point in each view; each None if unknown."""
        self._surfaces.take(state)
        shapes = self._shapes
        if shapes is None or shapes.version != state.version:
            return {"target": None, "drop": None, "tool": None}
        index = np.frombuffer(state.object_index, np.uint32)
        known = index < len(self._poses)
        self._poses[index[known]] = np.frombuffer(state.object_poses, np.float32).reshape(-1, 7)[known]
        tool = np.array(state.tool_pose)
        eyes = ((shapes.overview_eye, _STILL), (shapes.eye, tool))
        return {
            "target": self._target(shapes, state, tool, eyes),
            "drop": self._drop(shapes, state, tool, eyes),
            "tool": _flat(tool[None, :3], eyes),
        }

    def _target(self, shapes: SceneShapes, state: SceneState, tool: Floats, eyes: "_Eyes") -> dict[str, Any] | None:
        """Return the target's name, its outline in each view, and the way of its centre: right, up and ahead."""
        role = ROLES.index(Role.TARGET)
        target = state.roles.index(role) if role in state.roles else len(self._poses)
        seen_m = self._surfaces.target_corners_m() if target not in self._own else None
        if target not in self._own and seen_m is None:
            return None
        corners = self._body(target).corners if seen_m is None else seen_m
        centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        placed = np.vstack((centre, corners))
        placed = moved(self._poses[target], placed) if seen_m is None else placed
        right, down, ahead = ((placed[0] - tool[:3]) @ rotation(tool)).tolist()
        boxes = [None if eye is None else outline(placed[1:], frame, eye) for eye, frame in eyes]
        return {
            "name": shapes.objects[target] if seen_m is None else "target",
            "boxes": boxes,
            "way_m": (right, -down, ahead),
        }

    def _drop(self, shapes: SceneShapes, state: SceneState, tool: Floats, eyes: "_Eyes") -> dict[str, Any] | None:
        """Return what lies below the gripper's point, how far below it or what is held, and the line in each view."""
        held = None if state.near is None or state.near.held is None else state.near.held
        point, below, tool_m = tool[:3], [], float(tool[2])
        for owner in self._own.keys() - ({shapes.objects.index(held)} if held in shapes.objects else set()):
            if (far_m := self._body(owner).top_below_m(point, self._poses[owner])) is not None:
                below.append((far_m, shapes.objects[owner]))
        if (far_m := self._surfaces.top_below_m(point, with_target=held is None)) is not None:
            below.append((far_m, "a surface"))
        if not below:
            return None
        far_m, name = min(below)
        ends = np.array((point, point - (0.0, 0.0, far_m)))
        height_m = far_m
        if held in shapes.objects:
            owner = shapes.objects.index(held)
            height_m = max(0.0, self._body(owner).lowest_m(self._poses[owner]) - (tool_m - far_m))
        return {"name": name, "height_m": height_m, "lines": _flat(ends, eyes)}

    def _body(self, owner: int) -> _Body:
        if owner not in self._bodies:
            self._bodies[owner] = _Body(self._own[owner])
        return self._bodies[owner]


_Eyes = tuple[tuple[Eye | None, Floats], tuple[Eye | None, Floats]]
"""Eye of each view, in the order of VIEW_NAMES, and the pose of the frame in which the eye is given"""


def _flat(points: Floats, eyes: _Eyes) -> list[list[float] | None]:
    """Return where each view has points (n, 3) of the world frame, as 2n numbers; None where one is behind the eye."""
    places = [None if eye is None else seen(points, frame, eye) for eye, frame in eyes]
    return [None if place is None else [*map(float, np.ravel(place))] for place in places]
