"""Cues of the camera views, against heights and places worked out by hand."""

from typing import Any

import msgspec
import numpy as np
import pytest

from common.protocol.codec import decode_view
from common.protocol.view_messages import Eye, Near, SceneShapes, SceneState, Shape
from operator_side.viewing.console.cues import Cues
from tests.operator_side.console_feed import shapes, state

AHEAD = Eye((0.0, -0.1, -0.3), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0), 90.0)
"""Behind and above the tool, looking along its approach axis"""
ABOVE = Eye((0.5, 0.0, 2.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), 90.0)
"""Looks down at the table, with the world's x axis upwards"""
ALONG_X = (0.5, -0.5, 0.5, -0.5)
"""Quaternion of a tool whose z axis points along the world's x, and its y axis down"""


def scene(tool_m: tuple[float, float, float], held: str | None = None, **changed: Any) -> dict[str, Any]:
    made = decode_view(shapes())
    now = decode_view(state(0.0))
    assert isinstance(made, SceneShapes)
    assert isinstance(now, SceneState)
    cues = Cues()
    cues.shapes(msgspec.structs.replace(made, **{"eye": AHEAD, "overview_eye": ABOVE} | changed))
    shown = cues.of(msgspec.structs.replace(now, tool_pose=(*tool_m, *ALONG_X), near=Near(held=held)))
    return dict(msgspec.json.decode(msgspec.json.encode(shown)))


@pytest.mark.parametrize(
    ("tool_m", "name", "height_m"),
    [
        ((0.4, 0.0, 0.2), "table", 0.2),
        ((0.62, 0.0, 0.2), "mug", 0.1),
        ((0.6, 0.22, 0.3), "bottle", 0.04),
        ((0.55, -0.25, 0.2), "box", 0.08),
        ((0.62, 0.0, 0.05), "table", 0.05),
        ((0.75, 0.12, 0.5), "lamp", 0.3),
    ],
)
def test_the_height_is_that_above_the_next_upper_side_below(
    tool_m: tuple[float, float, float], name: str, height_m: float
) -> None:
    drop = scene(tool_m)["drop"]
    assert (drop["name"], drop["height_m"]) == (name, pytest.approx(height_m, abs=1e-3))


def test_a_held_object_counts_as_the_gripper_and_its_lowest_point_has_the_height() -> None:
    drop = scene((0.55, -0.25, 0.08), held="box")["drop"]
    assert (drop["name"], drop["height_m"]) == ("table", pytest.approx(0.0, abs=1e-6))
    assert scene((0.55, -0.25, 0.2))["drop"]["name"] == "box"


def test_a_turned_object_is_met_where_it_is() -> None:
    tall = Shape(0, False, "box", (0.5, 0.01, 0.01), (0.0, 0.0, 0.5, np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0))
    drop = scene((0.005, 0.0, 1.5), shapes=(tall,))["drop"]
    assert (drop["name"], drop["height_m"]) == ("table", pytest.approx(0.5))
    assert scene((0.1, 0.0, 1.5), shapes=(tall,))["drop"] is None


def test_both_views_have_the_line_and_the_target() -> None:
    shown = scene((0.5, 0.1, 0.2))
    overview, first_person = shown["drop"]["lines"]
    # From 2 m above: half the height of the picture is the depth; right is -y.
    assert overview == pytest.approx([-0.1 / 1.8, 0.0, -0.1 / 2.0, 0.0], abs=1e-6)
    assert shown["tool"] == [pytest.approx(line[:2]) for line in (overview, first_person)]
    assert first_person == pytest.approx([0.0, -0.1 / 0.3, 0.0, -0.3 / 0.3])
    target = shown["target"]
    assert (target["name"], target["way_m"]) == ("mug", pytest.approx([0.1, -0.15, 0.12]))
    left, low, right, high = target["boxes"][1]
    assert left < 0.1 / 0.42 < right
    assert low < (-0.15 - 0.1) / 0.42 < high
    assert target["boxes"][0][1] > 0.0


def test_unknown_eyes_leave_the_figures() -> None:
    shown = scene((0.4, 0.0, 0.2), eye=None, overview_eye=None)
    assert shown["drop"]["lines"] == [None, None]
    assert shown["target"]["boxes"] == [None, None]
    assert shown["tool"] == [None, None]
    assert shown["drop"]["height_m"] == pytest.approx(0.2)
    now = decode_view(state(0.0))
    assert isinstance(now, SceneState)
    assert Cues().of(now) == {"target": None, "drop": None, "tool": None}


def seen_by_depth(tool_m: tuple[float, float, float], held: str | None = None) -> dict[str, Any]:
    """Return the cues of a table at 0, a target's top at 0.1 m, and a board that stands on an edge."""
    upright = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)
    rows = [
        ((0.5, 0.0, -0.01), (1.0, 0.0, 0.0, 0.0), (0.4, 0.4, 0.01)),
        ((0.6, 0.0, 0.09), (1.0, 0.0, 0.0, 0.0), (0.05, 0.03, 0.01)),
        ((0.6, 0.2, 0.1), upright, (0.2, 0.05, 0.01)),
    ]
    surfaces = np.array([[*center, *turn, *half] for center, turn, half in rows], "<f4").tobytes()
    made, now = decode_view(shapes()), decode_view(state(0.0))
    assert isinstance(made, SceneShapes)
    assert isinstance(now, SceneState)
    cues = Cues()
    cues.shapes(msgspec.structs.replace(made, objects=(), shapes=(), eye=AHEAD, overview_eye=ABOVE))
    without = {"roles": b"", "object_index": b"", "object_poses": b"", "tool_pose": (*tool_m, *ALONG_X)}
    now = msgspec.structs.replace(now, near=Near(held=held), **without)
    cues.of(msgspec.structs.replace(now, surfaces=surfaces, surface_roles=bytes((2, 1, 0))))
    return dict(msgspec.json.decode(msgspec.json.encode(cues.of(now))))


@pytest.mark.parametrize(
    ("tool_m", "held", "height_m"),
    [
        ((0.4, 0.0, 0.2), None, 0.2),
        ((0.6, 0.0, 0.2), None, 0.1),
        ((0.6, 0.0, 0.2), "surface 4", 0.2),
        ((0.605, 0.2, 0.5), None, 0.2),
        ((0.62, 0.2, 0.5), None, 0.5),
    ],
)
def test_the_height_over_surfaces_is_that_over_the_next_one(
    tool_m: tuple[float, float, float], held: str | None, height_m: float
) -> None:
    assert seen_by_depth(tool_m, held)["drop"]["height_m"] == pytest.approx(height_m, abs=1e-6)


def test_beside_all_surfaces_there_is_no_height() -> None:
    assert seen_by_depth((1.5, 0.0, 0.2))["drop"] is None


def test_the_target_is_the_box_around_its_surfaces() -> None:
    target = seen_by_depth((0.5, 0.0, 0.2))["target"]
    assert target["name"] == "target"
    # The target's centre, 100 mm ahead and 110 mm below a tool that advances along the world's x axis.
    assert target["way_m"] == pytest.approx([0.0, -0.11, 0.1], abs=1e-6)
    overview = target["boxes"][0]
    assert overview == pytest.approx([-0.03 / 1.9, 0.05 / 1.9, 0.03 / 1.9, 0.15 / 1.9], abs=1e-3)
