"""docs/robots/compose.py, with an arm of one joint and hands of the 2F-85's joints."""

import runpy
import sys
from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import pytest

from tests.helpers.repository import ROOT

SCRIPT = str(ROOT / "docs" / "robots" / "compose.py")
BALL = '<geom size="0.01"/>'
ARM = f'<mujoco><worldbody><body><joint/>{BALL}<body name="right_hand">{BALL}</body></body></worldbody></mujoco>'
SIDES = "left", "right"
LINKS = "".join(
    f'<body name="{side}_outer_knuckle"><joint/>{BALL}'
    f'<body name="{side}_inner_finger"><joint name="{side}_inner_finger_joint"/>{BALL}</body></body>'
    f'<body name="{side}_inner_knuckle"><joint name="{side}_inner_knuckle_joint"/>{BALL}</body>'
    for side in SIDES
)
COUPLED = '<joint joint1="left_inner_finger_joint" joint2="left_inner_knuckle_joint"/>'


def compose(folder: Path, monkeypatch: pytest.MonkeyPatch, hand: str, *words: str) -> int:
    """Join the arm with a hand as the command does; return its exit code."""
    (folder / "arm.xml").write_text(ARM)
    (folder / "hand.xml").write_text(f"<mujoco>{hand}</mujoco>")
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "argv", [SCRIPT, "arm.xml", "hand.xml", "out.xml", *words])
    try:
        runpy.run_path(SCRIPT, run_name="__main__")
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


@pytest.mark.parametrize(
    ("links", "coupling", "words", "pinned"),
    [
        (LINKS, "", (), {f"g_{side}_inner_finger": f"g_{side}_inner_knuckle" for side in SIDES}),
        (LINKS, COUPLED, (), {}),
        (LINKS.replace("right_inner_knuckle_joint", "thumb"), "", (), {}),
        (
            LINKS,
            "",
            ("--pin=left_inner_knuckle,right_inner_knuckle,1,2,3",),
            {"g_left_inner_knuckle": "g_right_inner_knuckle"},
        ),
    ],
    ids=["2F-85", "coupled", "another hand", "pins that are given"],
)
def test_the_open_linkage_of_a_2f85_is_pinned(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    links: str,
    coupling: str,
    words: tuple[str, ...],
    pinned: dict[str, str],
) -> None:
    hand = f"<worldbody>{links}</worldbody><equality>{coupling}</equality>"
    assert compose(tmp_path, monkeypatch, hand, *words, "right_hand", "0.1") == 0
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
    pins = [number for number in range(model.neq) if model.eq_type[number] == mujoco.mjtEq.mjEQ_CONNECT]
    assert {model.body(model.eq_obj1id[pin]).name: model.body(model.eq_obj2id[pin]).name for pin in pins} == pinned
    places_m = {tuple(model.eq_data[pin][:3]) for pin in pins}
    assert places_m <= {(0.0, -0.0179, 0.0065), (1.0, 2.0, 3.0)}
    assert model.nexclude == len(pinned)
    assert model.key("home").qpos[0] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("left_hand",), "the arm has no body 'left_hand'; valid: world, right_hand"),
        (("--pin=a,b,0,0",), "--pin=a,b,0,0; valid: --pin=LINK,LINK,X,Y,Z"),
        (("right_hand", "north"), "'north'"),
        (("--pin=a,b,0,0,0",), "'g_a' not found"),
    ],
)
def test_wrong_words_end_with_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    said: str,
) -> None:
    assert compose(tmp_path, monkeypatch, f"<worldbody>{BALL}</worldbody>", *words) == 2
    complaint = capsys.readouterr().err
    assert said in complaint
    assert complaint.count("\n") == 1
