"""Scenes become Foxglove's own messages, and what they tell of overlaps and enlargement becomes JSON."""

import json
from pathlib import Path

import numpy as np

from common.protocol.codec import encode
from common.protocol.messages import Header
from common.protocol.view_messages import EnlargementTerms, SceneShapes, SceneState, Shape, ShapeKind
from common.recording.content import Content
from common.recording.mcap_file import RecordingFile
from common.recording.reading import open_recording
from common.recording.wire import HEADER, VIEW, as_json, stamped

HERE = (0.1, 0.2, 0.3, 1.0, 0.0, 0.0, 0.0)
KINDS: tuple[ShapeKind, ...] = ("sphere", "box", "cylinder", "capsule", "ellipsoid", "plane", "mesh")
TERMS = EnlargementTerms(0.01, 0.0, 0.001, 0.003, 0.002, 2.3, 0.1, 0.02)
POSE = np.array(HERE, dtype="<f4").tobytes()


def test_a_scene_is_drawn_once_and_moved(tmp_path: Path) -> None:
    corners = np.eye(3, dtype="<f4").tobytes()
    triangles = np.arange(3, dtype="<u4").tobytes()
    shapes = tuple(
        Shape(0, True, kind, (0.1, 0.2, 0.3), HERE, vertices_m=corners, triangles=triangles)
        if kind == "mesh"
        else Shape(0, False, kind, (0.1, 0.2, 0.3), HERE)
        for kind in KINDS
    )
    path = tmp_path / "scene.mcap"
    file = RecordingFile(path, 1.7e9)
    content = Content(file)
    content.take(0, HEADER + as_json({"side": "robot"}))
    for number in range(3):
        header = Header(1, 2 * number + 1, 1.0)
        scene = SceneShapes(header, 1, ("hand",), ("post",), shapes)
        state = SceneState(
            Header(1, 2 * number + 2, 1.0),
            version=1,
            taken_s=1.0,
            link_poses=POSE,
            object_index=np.zeros(1, dtype="<u4").tobytes(),
            object_poses=POSE,
            roles=b"\0",
            tool_pose=HERE,
            spheres=b"",
            overlaps=((0, 1e-9, 2e-9),),
            l2=TERMS,
            r2=TERMS,
            tick_p50_us=50.0,
            tick_p99_us=80.0,
            overruns=0,
        )
        for message in (scene, state):
            content.take(0, VIEW + stamped(1.0 + number) + encode(message))
    file.close()
    recording = open_recording(path)
    assert len(list(recording.messages(["/scene"]))) == 1
    moved = list(recording.messages(["/tf"]))
    assert len(moved) == 3
    assert all(name in moved[0].content for name in (b"link/hand", b"object/post", b"tool"))
    (overlap, *_) = recording.messages(["/overlap"])
    assert json.loads(overlap.content)["objects"] == [{"object": "post", "l2_mm3": 1.0, "r2_mm3": 2.0}]
    (terms, *_) = recording.messages(["/enlargement"])
    assert json.loads(terms.content)["r2"]["quantile"] == 2.3
    assert len(list(recording.messages(["/view"]))) == 6
