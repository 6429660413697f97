import msgspec
import pytest

from common.protocol.codec import claims_to_be, encode
from common.protocol.messages import Header
from common.protocol.view_messages import EnlargementTerms, SceneShapes, SceneState
from operator_side.scene_figures import SceneFigures

HEADER = Header(epoch=2**40, sequence=2**33, sent_s=123456.789)
NOWHERE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
TERMS = EnlargementTerms(0.01, 0.001, 0.001, 0.001, 0.001, 2.3, 0.1, 0.0)
STATE = SceneState(
    HEADER,
    version=1,
    taken_s=1.0,
    link_poses=b"",
    object_index=b"",
    object_poses=b"",
    roles=b"",
    tool_pose=NOWHERE,
    spheres=b"",
    overlaps=((0, 1e-6, 2e-6), (3, 0.5e-6, 0.0)),
    l2=TERMS,
    r2=TERMS,
    tick_p50_us=60.0,
    tick_p99_us=140.0,
    overruns=3,
)
SHAPES = SceneShapes(HEADER, version=1, links=("scene",), objects=(), shapes=())


def test_overlaps_of_the_trigger_with_more_and_ticks_are_read() -> None:
    figures = SceneFigures()
    assert figures.figures() == {}
    figures.take(encode(STATE))
    expected = {"overlap_mm3": 2000.0, "tick_us": 60.0, "tick_p99_us": 140.0, "overruns": 3}
    assert figures.figures() == pytest.approx(expected)
    figures.take(encode(msgspec.structs.replace(STATE, overlaps=())))
    assert figures.figures()["overlap_mm3"] == 0.0


def test_shapes_and_what_is_broken_change_nothing() -> None:
    figures = SceneFigures()
    figures.take(encode(STATE))
    before = figures.figures()
    for payload in (encode(SHAPES), encode(STATE)[:-3], b"", b"scene"):
        figures.take(payload)
        assert figures.figures() == before


def test_a_tag_is_told_without_unpacking() -> None:
    assert claims_to_be("scene", encode(STATE))
    assert not claims_to_be("scene", encode(SHAPES))
    assert claims_to_be("shapes", encode(SHAPES))
