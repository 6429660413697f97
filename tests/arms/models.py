"""MJCF files of the FR3, made of franky-sim's: with the hand for the robot side, without it for franka-sim."""

from pathlib import Path
from typing import Final
from xml.etree import ElementTree

JOINTS: Final = tuple(f"fr3_joint{number}" for number in range(1, 8))
START_RAD: Final = (0.0, 0.0, 0.0, -1.57, 0.0, 1.57, 0.785)
"""Where franka-sim's arm starts: the tool is 0.52 m above the base, and looks down"""
TIPS_M: Final = "0 0 0.1034"
"""Point between the fingertips, in the hand's frame"""
_WALL: Final = {"name": "wall", "type": "box", "size": "0.2 0.2 0.01", "pos": "0.554 0 0.15"}
_TABLE: Final = {"name": "table", "type": "box", "size": "0.2 0.2 0.01", "pos": "0.554 0 0.25"}
_TARGET: Final = {"name": "target", "type": "box", "size": "0.02 0.02 0.04", "pos": "0.554 0 0.3"}
SCENES: Final = {"wall": (_WALL,), "target": (_TABLE, _TARGET)}
"""What is below the tool: a lying wall that it comes to from above, or an object of 40 mm on a table"""


def write_models(assets: Path, folder: Path) -> None:
    """Write wall.xml, target.xml and arm.xml. assets: franky-sim's, with fr3.xml and meshes/."""
    folder.mkdir(exist_ok=True)
    for name, things in SCENES.items():
        root = _read(assets)
        hand = _body(root, "hand")
        hand.insert(0, ElementTree.Element("site", name="pinch", pos=TIPS_M))
        for thing in things:
            ElementTree.SubElement(next(root.iter("worldbody")), "geom", thing)
        ElementTree.ElementTree(root).write(folder / f"{name}.xml")
    root = _read(assets)
    _body(root, "fr3_link7").remove(_body(root, "hand"))
    for name in ("tendon", "equality", "keyframe", "actuator"):  # all of them name parts of the hand
        root.remove(next(root.iter(name)))
    ElementTree.ElementTree(root).write(folder / "arm.xml")


def _read(assets: Path) -> ElementTree.Element:
    root = ElementTree.parse(assets / "fr3.xml").getroot()  # noqa: S314  # of a wheel whose hash is locked
    next(root.iter("compiler")).set("meshdir", str(assets / "meshes"))
    return root


def _body(root: ElementTree.Element, name: str) -> ElementTree.Element:
    return next(body for body in root.iter("body") if body.get("name") == name)
