"""Whatever a robot side sends as a scene is drawn or refused: nothing of it ends the console."""

import contextlib
import socket
import struct
from types import SimpleNamespace
from typing import Any, get_args

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.companion.channel import Channel
from common.errors import RemoteProtocolError
from common.protocol.codec import decode_view, encode
from common.protocol.messages import Header
from common.protocol.view_messages import Eye, SceneShapes, SceneState, Shape, ShapeKind
from operator_side.viewing.console.__main__ import _Process
from operator_side.viewing.console.cues import Cues
from operator_side.viewing.console.drawing import Drawing
from tests.helpers.messages import scene_state

pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of poses without a direction
HEADER = Header(1, 1, 1.0)
HERE = (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
CORNERS, TRIANGLE = np.eye(3, dtype="<f4").tobytes(), np.arange(3, dtype="<u4").tobytes()
TRIANGLES = Shape(0, False, "mesh", (1.0, 1.0, 1.0), HERE, vertices_m=CORNERS, triangles=TRIANGLE)


class Handle(SimpleNamespace):
    def remove(self) -> None:
        pass


class Scene:
    """As much of viser as is drawn on."""

    def __getattr__(self, name: str) -> Any:
        return lambda *words, **options: Handle(text=words[-1:], **options)


class Server(SimpleNamespace):
    def atomic(self) -> Any:
        return pytest.MonkeyPatch.context()


def console() -> Any:
    process: Any = _Process(None)  # type: ignore[arg-type]
    process._pages = SimpleNamespace(show=lambda *_, **__: None, slow=False)
    process._cues = Cues()
    process._drawing = Drawing(Server(scene=Scene(), gui=Scene(), initial_camera=Handle()))  # type: ignore[arg-type]
    return process


REFUSED = {
    "13 bytes": {"vertices_m": CORNERS + bytes(13)},
    "no triangle": {"triangles": b""},
    "a vertex that is not there": {"triangles": np.array([0, 1, 3], "<u4").tobytes()},
    "a vertex nowhere": {"vertices_m": np.full(9, np.nan, "<f4").tobytes()},
    "no owner": {"owner": -5},
    "an endless size": {"size_m": (np.inf, 1.0, 1.0)},
}


@pytest.mark.parametrize("changed", REFUSED)
def test_a_shape_that_cannot_be_drawn_is_refused(changed: str) -> None:
    shape = msgspec.structs.astuple(TRIANGLES)
    names = Shape.__struct_fields__
    odd = [REFUSED[changed].get(name, value) for name, value in zip(names, shape, strict=True)]  # type: ignore[attr-defined]
    sound = msgspec.msgpack.encode(TRIANGLES)
    scene = encode(SceneShapes(HEADER, 1, ("hand",), ("post",), (TRIANGLES,)))
    assert decode_view(scene)
    with pytest.raises(RemoteProtocolError):
        decode_view(scene.replace(sound, msgspec.msgpack.encode(odd)))


@pytest.mark.parametrize("changed", [{"object_index": bytes(5)}, {"overlaps": ((-9, 0.0, 0.0),)}])
def test_a_state_that_cannot_be_shown_is_refused(changed: dict[str, Any]) -> None:
    state = scene_state(HEADER)
    with pytest.raises((RemoteProtocolError, ValueError)):
        decode_view(encode(msgspec.structs.replace(state, **changed)))


NUMBERS = st.sampled_from((0.0, 1.0, -1.0, 1e-30, 1e30, 1e300, np.nan, np.inf))
POSES = st.tuples(*[NUMBERS] * 7)
ROWS = st.lists(POSES, max_size=3).map(lambda rows: b"".join(struct.pack("<7f", *map(np.float32, row)) for row in rows))
MESHES = st.builds(
    Shape,
    st.integers(0, 3),
    st.booleans(),
    st.sampled_from(get_args(ShapeKind)),
    st.tuples(*[NUMBERS.filter(np.isfinite)] * 3),
    st.tuples(*[NUMBERS.filter(lambda value: abs(value) < 1e100)] * 7),
    vertices_m=st.just(CORNERS),
    triangles=st.lists(st.integers(0, 2), min_size=3, max_size=3).map(lambda one: np.array(one, "<u4").tobytes()),
)
EYES = st.none() | st.builds(Eye, *[st.tuples(*[NUMBERS] * 3)] * 3, NUMBERS)


@given(st.data())
def test_any_scene_that_is_decoded_is_drawn(data: st.DataObject) -> None:
    process = console()
    names = st.lists(st.sampled_from(["a", "b", "c"]), max_size=3).map(tuple)
    for version in (1, 2):
        links, objects = data.draw(names), data.draw(names)
        shapes = tuple(data.draw(st.lists(MESHES, max_size=4)))
        scene = SceneShapes(HEADER, version, links, objects, shapes, 0, b"", data.draw(EYES), data.draw(EYES))
        process._view(encode(scene))
        for _ in range(2):
            poses = data.draw(ROWS)
            index = data.draw(st.lists(st.integers(0, 3), min_size=len(poses) // 28, max_size=len(poses) // 28))
            state = msgspec.structs.replace(
                scene_state(HEADER, version),
                link_poses=bytes(28 * len(links)),
                object_index=np.array(index, "<u4").tobytes(),
                object_poses=poses,
                roles=bytes(data.draw(st.lists(st.integers(0, 255), max_size=4))),
                tool_pose=data.draw(POSES),
                overlaps=((data.draw(st.integers(0, 2**31 - 1)), data.draw(NUMBERS), data.draw(NUMBERS)),),
            )
            seen = process._view(encode(state))
            assert isinstance(seen, SceneState)
            process._show_scene(seen)


def test_a_view_that_cannot_be_shown_is_skipped_and_said_once(monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = socket.socketpair()
    notes: list[str] = []

    def fail(_: bytes) -> None:
        raise ValueError("of no kind that was thought of")

    with contextlib.closing(Channel(one)) as channel, other:
        process = _Process(channel)
        monkeypatch.setattr(process, "_pages", SimpleNamespace(note=notes.append))
        monkeypatch.setattr(process, "_view", fail)
        assert [process._take(b"v", b"") for _ in range(3)] == [None] * 3
    [note] = notes
    assert "skipped: ValueError" in note
    assert process._skipped == 3
