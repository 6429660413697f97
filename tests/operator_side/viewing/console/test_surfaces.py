"""Surfaces that depth cameras see, as the console draws them."""

from typing import Any

import msgspec
import numpy as np
import pytest

from common.errors import RemoteProtocolError
from common.protocol.codec import decode_view, encode
from common.protocol.messages import Header
from common.protocol.view_messages import SceneShapes
from common.roles import ROLES, Role
from operator_side.viewing.console.drawing import Drawing
from tests.helpers.messages import scene_state
from tests.operator_side.viewing.console.test_hostile_scenes import Handle, Scene, Server

HEADER = Header(1, 1, 1.0)
SHAPES = SceneShapes(HEADER, 1, ("hand",), ("cup",), ())
INVISIBLE = 1e-5


def drawn(count: int, drawing: Drawing) -> Any:
    """Draw so many surfaces, and return what viser was told."""
    rows = np.tile(np.array([0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0, 0.04, 0.03, 0.002], "<f4"), (count, 1))
    roles = bytes(ROLES.index((Role.TARGET, Role.SUPPORT)[number % 2]) for number in range(count))
    state = msgspec.structs.replace(scene_state(HEADER), surfaces=rows.tobytes(), surface_roles=roles)
    drawing.state(state, (None, None), "R2")
    return drawing._surfaces._handle


@pytest.fixture
def drawing() -> Drawing:
    made = Drawing(Server(scene=Scene(), gui=Scene(), initial_camera=Handle()))  # type: ignore[arg-type]
    made.shapes(SHAPES)
    return made


def test_surfaces_are_drawn_in_the_colours_of_their_roles(drawing: Drawing) -> None:
    handle = drawn(3, drawing)
    visible = handle.batched_scales.max(axis=1) > INVISIBLE
    assert np.flatnonzero(visible).tolist() == [0, 1, 2]
    assert handle.batched_positions[0] == pytest.approx([0.1, 0.2, 0.3])
    assert handle.batched_scales[0] == pytest.approx([0.04, 0.03, 0.002])
    assert (handle.batched_colors[0] == handle.batched_colors[2]).all()
    assert (handle.batched_colors[0] != handle.batched_colors[1]).any()


def test_they_stay_until_others_come_and_need_no_new_batch_for_each(drawing: Drawing) -> None:
    few = drawn(200, drawing)
    drawing.state(scene_state(HEADER), (None, None), "R2")
    assert (few.batched_scales.max(axis=1) > INVISIBLE).sum() == 200
    assert drawn(0, drawing) is few
    assert (few.batched_scales.max(axis=1) > INVISIBLE).sum() == 0
    assert drawn(256, drawing) is few
    more = drawn(257, drawing)
    assert more is not few
    assert (more.batched_scales.max(axis=1) > INVISIBLE).sum() == 257


@pytest.mark.parametrize("surfaces", [None, bytes(39), bytes(80)], ids=["none", "short", "long"])
def test_surfaces_that_do_not_fit_their_roles_are_refused(surfaces: bytes | None) -> None:
    version, (*fields, _, _, unseen) = msgspec.msgpack.decode(encode(scene_state(HEADER)))
    with pytest.raises(RemoteProtocolError, match="surfaces has"):
        decode_view(msgspec.msgpack.encode([version, [*fields, surfaces, bytes(1), unseen]]))
