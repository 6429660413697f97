import numpy as np

from common.roles import ROLES, Role
from robot_side.depth.boxes import Boxes
from robot_side.depth.perception import DepthPerception
from robot_side.depth.settings import MapSettings
from robot_side.depth.slots import PIECES, TARGET_NAME, Slots
from robot_side.surroundings.perceived import PerceivedObjects
from tests.robot_side.depth.mapping import NOBODY
from tests.robot_side.depth.ray_cast import Box, Camera, looking

SETTINGS = MapSettings(lower_m=(0.0, -0.5, -0.1), upper_m=(0.95, 0.5, 0.9), slots=512)
ABOVE = Camera(looking((0.1, -0.1, 0.8), (0.5, 0.0, 0.05)))
TABLE = Box((0.5, 0.0, -0.05), (0.4, 0.4, 0.05))
CUBE = Box((0.5, 0.0, 0.03), (0.03, 0.03, 0.03))
OTHER = Box((0.5, 0.3, 0.03), (0.03, 0.03, 0.03))
NEAR = np.array([0.5, 0.0, 0.2])


class Pointing:
    """A map of a table with two cubes, and the frames that it hands on."""

    def __init__(self) -> None:
        self.perception, self._shown = DepthPerception(SETTINGS), Slots(SETTINGS.slots)
        self._time_s = 0.0
        self.look(6)

    def look(self, frames: int = 2) -> PerceivedObjects:
        for _ in range(frames):
            picture = ABOVE.picture([TABLE, CUBE, OTHER], self._time_s, None)
            self.perception.see(picture, ABOVE.pose, NOBODY, ABOVE.errors, 0)
            self._time_s += 0.033
        self._shown.apply(self.perception.changes(NEAR))
        return self._shown.frame(self._time_s, self._shown.sds_m)

    def point_at(self, place_m: tuple[float, float, float]) -> PerceivedObjects:
        objects = self.look()
        away_m = np.linalg.norm(objects.box_centers_m[PIECES:] - np.array(place_m), axis=1)
        self.perception.set_role(objects.names[1 + int(away_m.argmin())], Role.TARGET)
        return self.look()


def _pieces_m(objects: PerceivedObjects) -> np.ndarray:
    used = objects.box_half_sizes_m[:PIECES].max(axis=1) > 0.001
    pieces_m: np.ndarray = objects.box_centers_m[:PIECES][used & (objects.box_centers_m[:PIECES, 2] > -1.0)]
    return pieces_m


def test_without_labels_there_is_no_target() -> None:
    assert Pointing().look().roles[0] is Role.OBSTACLE


def test_who_points_at_a_cube_takes_the_cube_and_not_the_table() -> None:
    objects = Pointing().point_at((0.5, 0.0, 0.05))
    assert objects.roles[0] is Role.TARGET
    pieces_m = _pieces_m(objects)
    assert len(pieces_m) > 0
    assert np.abs(pieces_m[:, :2] - np.array([0.5, 0.0])).max() < 0.045
    table = np.abs(objects.box_centers_m[PIECES:, 2] - 0.0) < 0.03
    assert np.count_nonzero(table) > 3


def test_the_next_target_is_another_one_and_the_first_becomes_an_obstacle() -> None:
    pointing = Pointing()
    pointing.point_at((0.5, 0.0, 0.05))
    pointing.perception.set_role(TARGET_NAME, Role.OBSTACLE)
    assert pointing.look().roles[0] is Role.OBSTACLE
    objects = pointing.point_at((0.5, 0.3, 0.05))
    assert np.abs(_pieces_m(objects)[:, 1] - 0.3).max() < 0.045


def test_a_name_without_a_surface_changes_nothing() -> None:
    pointing = Pointing()
    before = pointing.look()
    pointing.perception.set_role("surface 500", Role.TARGET)
    pointing.perception.set_role("nothing", Role.TARGET)
    assert pointing.look().roles == before.roles


def test_an_object_is_found_by_its_name_and_one_without_a_box_is_not() -> None:
    slots = Slots(64)
    boxes = Boxes(
        ids=np.array([7]),
        centers_m=np.zeros((1, 3)),
        rotations=np.eye(3)[None],
        half_sizes_m=np.array([[0.08, 0.08, 0.01]]),
        roles=np.array([ROLES.index(Role.TARGET)]),
        sds_m=np.zeros(1),
    )
    slots.update(boxes, NEAR)
    assert slots.box_of(TARGET_NAME) == 7
    assert slots.box_of("surface 1") is None


def test_a_perception_tells_which_space_around_the_tool_nobody_has_seen() -> None:
    ahead = looking((0.3, 0.0, 0.3), (0.5, 0.0, 0.1)).rotation
    tool_m = np.array([0.3, -0.05, 0.4])
    assert DepthPerception(SETTINGS).newest() == {}
    perception = Pointing().perception
    assert perception.newest()["boxes"] > 0.0
    # What is ahead lies in the picture, what is behind the camera's back does not.
    unknown = perception.unknown(tool_m, ahead)
    assert unknown.ahead < 0.5 < unknown.up
    assert not len(unknown.boxes_m)
