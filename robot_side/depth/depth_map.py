"""The map: pictures of depth cameras in, boxes behind the surfaces out."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from common.arrays import FloatArray, IntArray
from common.roles import ROLES, Role
from robot_side.depth.boxes import Boxes
from robot_side.depth.free_space import SeenSpace
from robot_side.depth.grid import Grid
from robot_side.depth.motion.carrying import Carried
from robot_side.depth.motion.seer import UNSEEN_S, MotionSeer
from robot_side.depth.motion.snapshots import snapshot
from robot_side.depth.octree.planes import Planes
from robot_side.depth.own_body import HELD_M, beyond_m, own_pixels
from robot_side.depth.picture import CameraPose, DepthArray, DepthErrors, DepthPicture, LabelArray, OwnBody
from robot_side.depth.pointing import patch_around
from robot_side.depth.settings import MapSettings
from robot_side.depth.support import normals, supported
from robot_side.depth.surfel_map.surfels import SurfelMap
from robot_side.depth.view import view_of

NO_ROLE: Final = -1


@dataclass(frozen=True)
class Integrated:
    """What one picture did."""

    made: int
    """Cells with points for the first time"""
    contradicted: int
    """Surfels that are gone, as something is measured behind them"""
    unanswered: int
    """Surfels that are gone, as they were in view without an answer for too long"""
    without_room: int
    """Pixels for which the map had no room"""
    own_pixels: int
    """Pixels of the robot's own, and those beside them"""
    holes: int
    """Pixels in which nothing was measured within range"""
    without_support: int
    """Pixels with which too few neighbours agree"""
    boxes: int
    """Boxes that there are now"""
    changed: int
    """Boxes that are new, gone, or elsewhere"""


class DepthMap:
    """Surfaces in a fixed region, which all cameras share."""

    def __init__(self, settings: MapSettings) -> None:
        self.settings = settings
        grid = Grid.of(settings)
        self.surfels = SurfelMap(grid)
        self.planes = Planes(grid)
        self.seen = SeenSpace(settings)
        self.motion = MotionSeer()
        self._carried = Carried(self.surfels)
        self._holds = False
        self._taken_s: dict[int, float] = {}

    def integrate(
        self, picture: DepthPicture, pose: CameraPose, body: OwnBody, errors: DepthErrors, camera: int = 0
    ) -> Integrated:
        """Add a picture. pose: of the camera when it was taken; body: the robot's own solids at that time.

        camera: which of the cameras took it.
        """
        view = view_of(picture.pinhole, pose, errors)
        measured = np.ascontiguousarray(picture.depth_m)
        depth_m = supported(measured, view)
        own = own_pixels(depth_m, view, body, self.settings.padding_m)
        facing = normals(depth_m, view)
        self._taken_s[camera] = picture.taken_s
        self.motion.end_unseen(picture.taken_s)
        self._carried.move(picture.taken_s, self.motion.movers)
        merged = self.surfels.integrate(picture, depth_m, facing, own, view, camera)
        self._find_motion(picture, pose, errors, depth_m, facing, own, camera)
        if body.models:
            self._forget(body.known(), self.settings.padding_m)
        if body.held and not self._holds:
            # The gripper hides its place until it is far from there.
            self._forget(body.carried(), HELD_M, Role.TARGET)
        self._holds = body.held > 0
        self.seen.see(depth_m, view)
        changed = self.planes.follow(self.surfels)
        valid = (measured >= errors.least_m) & (measured <= errors.most_m)
        answers, supports = int(np.count_nonzero(valid)), int(np.count_nonzero(depth_m))
        return Integrated(
            made=merged.made,
            contradicted=merged.contradicted,
            unanswered=merged.unanswered,
            without_room=merged.without_room,
            own_pixels=int(np.count_nonzero(own)),
            holes=depth_m.size - answers,
            without_support=answers - supports,
            boxes=self.planes.count,
            changed=changed,
        )

    def _forget(self, solids: OwnBody, near_m: float, role: Role | None = None) -> None:
        """Remove the surfels near some solids: those of a role, if one is given."""
        rows, table = self.surfels.shown, self.surfels.table
        if role is not None:
            rows = rows[table.roles[rows] == ROLES.index(role)]
        self.surfels.forget(rows[beyond_m(table.points_m[rows], solids) <= near_m])

    def _find_motion(
        self,
        picture: DepthPicture,
        pose: CameraPose,
        errors: DepthErrors,
        depth_m: DepthArray,
        facing: DepthArray,
        own: LabelArray,
        camera: int,
    ) -> None:
        """See what moves, and take the surfels that do."""
        coarse = snapshot(picture, pose, errors, depth_m, facing, own, self.motion.noise(camera))
        if (members := self.motion.see(coarse, errors, camera)) is not None:
            self._carried.mark(coarse, members, self.motion.of_camera(camera))

    def boxes(self) -> Boxes:
        """Return the boxes behind all surfaces that have been in two pictures."""
        return self.planes.boxes()

    @property
    def moved_s(self) -> float:
        """Time at which what moves is where the map has it: that of the camera furthest behind, but for silent ones"""
        newest_s = max(self._taken_s.values(), default=math.nan)
        return min((one for one in self._taken_s.values() if newest_s - one <= UNSEEN_S), default=math.nan)

    def velocities_m_s(self, boxes: Boxes) -> FloatArray:
        """Return the velocity (n, 3) of each of the map's boxes, in the world; 0 for what is not seen to move."""
        return self._carried.velocities(boxes, self.motion.movers)

    def mark(self, box: int, role: Role) -> None:
        """Give a role to the patch of surface at the box of this number, as far as the gripper may grasp it."""
        boxes = self.planes.boxes()
        found = np.flatnonzero(boxes.ids == box)
        if found.size:
            rows = patch_around(boxes, int(found[0]), self.surfels, self.settings.cell_m)
            self._give(rows, role)

    def unmark(self, role: Role) -> None:
        """Take the role from all surfaces that have it."""
        rows = self.surfels.shown
        self._give(rows[self.surfels.table.roles[rows] == ROLES.index(role)], Role.OBSTACLE)

    def _give(self, rows: IntArray, role: Role) -> None:
        table = self.surfels.table
        table.roles[rows] = NO_ROLE if role is Role.OBSTACLE else ROLES.index(role)
        table.pointed[rows] = 1
        self.surfels.look_again(rows)
