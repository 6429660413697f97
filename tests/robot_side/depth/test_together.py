"""Which boxes are of one plane."""

from dataclasses import replace

import numpy as np

from robot_side.depth.boxes import Boxes
from robot_side.depth.together import largest_piece, planes_of


def test_boxes_are_of_one_plane_by_way_of_their_neighbours() -> None:
    # A row of three that begins at its end, one behind them, one beyond a gap, and one that leans.
    centers_m = np.array([[0.04, 0, 0], [0.0, 0, 0.02], [0.0, 0, 0], [0.02, 0, 0], [0.1, 0, 0], [0.06, 0, 0]])
    rotations = np.tile(np.eye(3), (6, 1, 1))
    rotations[5] = [[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]
    boxes = Boxes(np.arange(6), centers_m, rotations, np.full((6, 3), 0.01), np.full(6, -1), np.zeros(6))
    np.testing.assert_array_equal(planes_of(boxes), [0, 1, 0, 0, 2, 3])
    roles = np.array([-1, -1, 2, -1, -1, -1])
    np.testing.assert_array_equal(planes_of(replace(boxes, roles=roles)), [0, 2, 1, 0, 3, 4])
    np.testing.assert_array_equal(largest_piece(boxes, np.array([1, 2, 4])), [True, True, False])
    assert len(planes_of(Boxes(*(column[:0] for column in vars(boxes).values())))) == 0
