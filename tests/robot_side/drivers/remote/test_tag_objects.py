"""The example that perceives tags: in pictures drawn here, and over real sockets."""

import importlib.util
import math
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.roles import Role
from common.sockets.driver_port import DriverPort
from robot_side.drivers.remote.objects import RemoteObjects
from tests.helpers.python_process import ended, start
from tests.helpers.repository import ROOT
from tests.helpers.socket_talk import EPHEMERAL, ROUNDS

SCRIPT = ROOT / "docs" / "drivers" / "tag_objects.py"
FILE = """
dictionary = "DICT_APRILTAG_36h11"
keep_s = 0.0

[camera]
width = 640
height = 480
fx = 600.0
fy = 610.0
cx = 320.0
cy = 238.0
latency_s = 0.05
position_m = [0.4, -0.6, 0.5]
quaternion = [0.4, 0.8, 0.2, 0.4]
sd_m = 0.0

[[objects]]
name = "target box"
box = [0.03, 0.02, 0.04]
tags = [{ id = 3, side_m = 0.06, position_m = [0.0, 0.0, 0.04] }]

[[objects]]
name = "post"
role = "obstacle"
box = [0.02, 0.02, 0.1]
tags = [
    { id = 5, side_m = 0.04, position_m = [0.0, -0.02, 0.0], quaternion = [0.7071, 0.7071, 0.0, 0.0] },
    { id = 6, side_m = 0.08, position_m = [0.0, 0.02, 0.0], quaternion = [0.0, 0.0, 0.7071, 0.7071] },
]

[[fixed]]
name = "table"
half_space = true
"""
LENS = np.array([[600.0, 0.0, 320.0], [0.0, 610.0, 238.0], [0.0, 0.0, 1.0]])
CAMERA_M, CAMERA = np.array([0.4, -0.6, 0.5]), Rotation.from_quat([0.4, 0.8, 0.2, 0.4], scalar_first=True)
BOX_M = np.array([0.03, 0.02, 0.04])
CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
SHEET = np.array([[-0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [-0.5, -0.5, 0.0]])
"""Corners of a tag's black square of side 1 as printed: upper left, upper right, lower right, lower left"""
FACING = Rotation.from_euler("x", math.pi)
"""Orientation in the camera's frame of a tag that looks into the camera, upright"""


def loaded() -> ModuleType:
    found = importlib.util.spec_from_file_location("tag_objects", SCRIPT)
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


EXAMPLE = loaded()


def tags(folder: Path, *changes: tuple[str, str]) -> Any:
    """Return the example's perception with the file above, after these changes of its text."""
    return EXAMPLE.Tags(written(folder, *changes))


def written(folder: Path, *changes: tuple[str, str]) -> Path:
    text, path = FILE, folder / "tags.toml"
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def drawn(*seen: tuple[int, float, Rotation, tuple[float, float, float]], seed: int = 1) -> Any:
    """Draw tags into a picture: number, side in m, orientation and place in the camera's frame; with noise."""
    kind = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    fine, pixels, margin = 4, 200, 40  # Four pixels in each direction make one.
    picture = np.full((480 * fine, 640 * fine), 130, dtype=np.uint8)
    finer = np.array([[fine, 0.0, (fine - 1) / 2], [0.0, fine, (fine - 1) / 2], [0.0, 0.0, 1.0]])
    for number, side_m, turn, place_m in seen:
        sheet = np.full((pixels + 2 * margin,) * 2, 255, dtype=np.uint8)
        sheet[margin:-margin, margin:-margin] = cv2.aruco.generateImageMarker(kind, number, pixels)
        unit, first = side_m / pixels, (0.5 - margin) * side_m / pixels - side_m / 2
        on_sheet = np.array([[unit, 0.0, first], [0.0, -unit, -first], [0.0, 0.0, 1.0]])
        plane = finer @ LENS @ np.column_stack([turn.as_matrix()[:, :2], place_m]) @ on_sheet
        cv2.warpPerspective(sheet, plane, picture.shape[::-1], dst=picture, borderMode=cv2.BORDER_TRANSPARENT)
    small = cv2.GaussianBlur(cv2.resize(picture, (640, 480), interpolation=cv2.INTER_AREA), (0, 0), 0.6)
    noise = np.random.default_rng(seed).normal(0.0, 4.0, small.shape)
    return np.clip(small + noise, 0.0, 255.0).astype(np.uint8)


def corners_px(side_m: float, turn: Rotation, place_m: tuple[float, float, float]) -> Any:
    """Return where the corners of a tag are seen, (4, 2)."""
    seen = (turn.apply(SHEET * side_m) + place_m) @ LENS.T
    return seen[:, :2] / seen[:, 2:]


def box_in_world_m(turn: Rotation, place_m: tuple[float, float, float]) -> Any:
    """Return the corners of the target box, whose tag lies on its top, (8, 3)."""
    on_top = CORNERS * BOX_M - [0.0, 0.0, BOX_M[2]]
    return CAMERA.apply(turn.apply(on_top) + place_m) + CAMERA_M


def sent_corners_m(thing: dict[str, Any]) -> FloatArray:
    turn = Rotation.from_quat(thing["quaternion"], scalar_first=True)
    return np.asarray(turn.apply(CORNERS * thing["box"]) + thing["position_m"])


def slanted(degrees: float, about: float) -> Rotation:
    """Return the orientation of a tag that is turned away by `degrees`, about an axis in its plane."""
    return Rotation.from_rotvec(math.radians(degrees) * np.array([math.cos(about), math.sin(about), 0.0])) * FACING


@pytest.mark.parametrize(("distance_m", "degrees"), [(0.3, 0.0), (0.3, 30.0), (0.45, 30.0), (0.45, 50.0)])
def test_a_box_in_a_picture_is_where_it_is_within_its_error(tmp_path: Path, distance_m: float, degrees: float) -> None:
    perception, rng = tags(tmp_path), np.random.default_rng(3)
    for seed in range(6):
        turn = slanted(degrees, rng.uniform(0.0, 2.0 * math.pi)) * Rotation.from_euler("z", rng.uniform(-3.0, 3.0))
        at_m = (0.1 * distance_m, -0.05 * distance_m, distance_m)
        table, *seen = perception.objects(drawn((3, 0.06, turn, at_m), seed=seed), 0.1 * seed)
        assert table == {"name": "table", "half_space": True}
        [thing] = seen
        assert (thing["name"], thing["role"], thing["box"]) == ("target box", None, tuple(BOX_M))
        error_m = np.linalg.norm(sent_corners_m(thing) - box_in_world_m(turn, at_m), axis=1).max()
        assert error_m < 3.0 * thing["sd_m"]
        # Straight on the poses to both sides fit.
        assert thing["sd_m"] <= (0.005 if degrees else 0.02)


def test_the_error_is_that_of_the_corners_noise(tmp_path: Path) -> None:
    perception, rng = tags(tmp_path), np.random.default_rng(4)
    turn, at_m = slanted(40.0, 1.0), (0.02, 0.01, 0.4)
    corners, errors_m, sds_m = corners_px(0.06, turn, at_m), [], []
    for _ in range(300):
        thing = perception.place(3, corners + rng.normal(0.0, 0.5, (4, 2)))
        errors_m.append(sent_corners_m(thing) - box_in_world_m(turn, at_m))
        sds_m.append(thing["sd_m"])
    # Of the corner that errs most, along the direction in which it errs most.
    spread_m2 = [np.linalg.eigvalsh(np.cov(np.array(errors_m)[:, corner].T)).max() for corner in range(8)]
    assert 1.0 < np.mean(sds_m) / math.sqrt(max(spread_m2)) < 1.5
    # Straight ahead and without a lever it is z² p / (√2 f s) along the view; a slant and a lever add to it.
    assert np.mean(sds_m) > 0.4**2 * 0.5 / (math.sqrt(2.0) * 610.0 * 0.06)


def test_a_camera_with_distortion_and_an_error_of_its_own(tmp_path: Path) -> None:
    bent = [-0.3, 0.1, 0.001, -0.002, 0.0]
    perception = tags(tmp_path, ("cx = 320.0", f"cx = 320.0\ndistortion = {bent}"), ("sd_m = 0.0", "sd_m = 0.02"))
    turn, at_m = slanted(40.0, 2.0), (0.08, 0.06, 0.35)
    pixels, _ = cv2.projectPoints(SHEET * 0.06, turn.as_rotvec(), np.array(at_m), LENS, np.array(bent))
    thing = perception.place(3, pixels[:, 0])
    assert np.abs(sent_corners_m(thing) - box_in_world_m(turn, at_m)).max() < 1e-4
    assert 0.02 < thing["sd_m"] < 0.021


def test_a_tag_of_which_two_poses_fit_is_left_out_and_one_that_fits_badly_is_believed_less(tmp_path: Path) -> None:
    perception = tags(tmp_path)
    far = corners_px(0.06, slanted(45.0, 0.5), (0.0, 0.0, 0.9))
    assert perception.place(3, far) is None
    assert tags(tmp_path, ("cx = ", "noise_px = 0.02\ncx = ")).place(3, far) is not None
    near = corners_px(0.06, slanted(35.0, 0.5), (0.0, 0.0, 0.3))
    bent = near + np.array([[2.0, 0.0], [0.0, 0.0], [2.0, 0.0], [0.0, 0.0]])
    # For four corners nearly in a line OpenCV finds no pose at all.
    line = np.array([[315.835, 114.445], [315.643, 114.287], [315.527, 114.155], [315.494, 114.110]])
    assert perception.place(3, line) is None
    assert perception.place(3, bent)["sd_m"] > 2.0 * perception.place(3, near)["sd_m"]


def test_the_tag_that_errs_least_tells_and_one_that_is_there_twice_does_not(tmp_path: Path) -> None:
    perception = tags(tmp_path)
    small = (5, 0.04, slanted(40.0, 0.0), (-0.1, 0.0, 0.45))
    large = (6, 0.08, slanted(40.0, 1.0), (0.1, 0.0, 0.45))
    other = (7, 0.06, slanted(40.0, 1.0), (0.0, -0.12, 0.45))
    _, one = perception.objects(drawn(small, other), 0.0)
    _, both = perception.objects(drawn(small, large), 1.0)
    assert (one["name"], one["role"], both["name"]) == ("post", "obstacle", "post")
    assert both["sd_m"] < one["sd_m"]
    # The large one is on the back: from its centre the post's centre is 2 cm against its z axis.
    centre_m = CAMERA.apply(large[2].apply([0.0, 0.0, -0.02]) + large[3]) + CAMERA_M
    assert np.abs(both["position_m"] - centre_m).max() < 3.0 * both["sd_m"]
    twice = (6, 0.08, slanted(40.0, 1.0), (-0.1, 0.0, 0.45))
    assert len(perception.objects(drawn(large, twice), 2.0)) == 1


def test_what_is_not_seen_stays_for_the_time_of_the_file_less_surely_and_is_gone_then(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    perception = tags(tmp_path, ("keep_s = 0.0", "keep_s = 0.5"))
    nothing = drawn()
    _, seen = perception.objects(drawn((3, 0.06, slanted(40.0, 1.0), (0.0, 0.0, 0.35))), 1.0)
    assert perception.objects(nothing, 1.25)[1:] == [seen | {"sd_m": pytest.approx(seen["sd_m"] + 0.005, abs=1e-9)}]
    assert perception.objects(nothing, 1.75)[1:] == []
    assert re.fullmatch(r"target box: seen, sd \d mm\ntarget box: gone: .*\n", capsys.readouterr().out)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("keep_s = 0.0", "keep_s =", "Invalid value"),
        ("36h11", "36h12", "dictionary = 'DICT_APRILTAG_36h12'; valid: DICT_4X4_100, "),
        ("cy = 238.0", "cy = 238.0\ndistortion = [0.1, 0.2]", "camera.distortion has 2 values; valid: (0, 4, 5, "),
        ("fx = 600.0", "", "required field `fx` - at `$.camera`"),
        ("fx = 600.0", "fx = -1.0", "`$.camera.fx`"),
        ("quaternion = [0.4, 0.8, 0.2, 0.4]", "quaternion = [0.0, 0.0, 0.0, 0.0]", "zero norm"),
        ("side_m = 0.06", "side_mm = 60", "unknown field `side_mm` - at `$.objects[0].tags[0]`"),
        ("id = 6", "id = 5", "is there twice"),
        ("post", "target box", "is there twice"),
    ],
)
def test_a_file_that_is_wrong_ends_it_with_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, said: str
) -> None:
    assert EXAMPLE.main([str(written(tmp_path, (old, new)))]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("tag_objects: ")
    assert said in complaint
    assert complaint.count("\n") == 1


def test_the_file_of_the_guide_is_accepted(tmp_path: Path) -> None:
    guide = (ROOT / "docs" / "drivers.md").read_text(encoding="utf-8")
    [block] = re.findall(r"^ +dictionary = .*?half_space = true$", guide, re.DOTALL | re.MULTILINE)
    (tmp_path / "tags.toml").write_text(block)
    assert [*EXAMPLE.Tags(tmp_path / "tags.toml").tags] == [3, 4]


class Device:
    """Stand-in for cv2.VideoCapture on a clock of its own: two pictures have waited, then one comes each 30 ms."""

    def __init__(self, number: int) -> None:
        assert number == 0
        self.grabbed, self.now_s = 0, 100.0

    def monotonic(self) -> float:
        return self.now_s

    def set(self, _what: int, _value: float) -> None:
        pass

    def grab(self) -> bool:
        self.grabbed += 1
        self.now_s += 0.03 if self.grabbed > 2 else 0.0001
        return self.grabbed < 5

    def retrieve(self) -> tuple[bool, Any]:
        return True, np.full((480, 640), self.grabbed)


def test_pictures_that_have_waited_are_passed_over_and_the_end_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = Device(0)
    monkeypatch.setattr(cv2, "VideoCapture", lambda _: device)
    monkeypatch.setattr(EXAMPLE, "time", device)
    pictures = EXAMPLE.taken(tags(tmp_path).file.camera)
    (first, first_s), (second, second_s) = next(pictures), next(pictures)
    assert (first[0, 0], second[0, 0]) == (3, 4)
    assert (first_s, second_s) == pytest.approx((100.0302 - 0.05, 100.0602 - 0.05))
    with pytest.raises(OSError, match="source = 0 gives no picture"):
        next(pictures)
    device.grabbed = 0
    with pytest.raises(OSError, match="pictures are not 641 x 480"):
        next(EXAMPLE.taken(tags(tmp_path, ("width = 640", "width = 641")).file.camera))


@pytest.mark.processes
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nowhere"])
def test_without_a_camera_or_an_address_it_ends_with_one_line(tmp_path: Path, address: str) -> None:
    path = written(tmp_path, ("[camera]", f'[camera]\nsource = "{tmp_path}/none"'))
    code, said, complaint = ended(str(SCRIPT), str(path), address)
    assert (code, said) == (2, "")
    assert complaint.startswith("tag_objects: ")
    assert ("gives no picture" in complaint) is (address != "nowhere")
    assert complaint.count("\n") == 1


PROGRAM = """
import sys, time
sys.path.insert(0, sys.argv[1])
import numpy
import tag_objects
def pictures(picture):
    while True:
        time.sleep(1 / 30)
        yield picture, time.monotonic() - 0.05
tag_objects.main(sys.argv[3:], pictures(numpy.load(sys.argv[2])))
"""


@pytest.mark.processes
def test_its_objects_are_perceived_with_their_errors_and_their_age(tmp_path: Path) -> None:
    turn, at_m = slanted(40.0, 1.0), (0.0, 0.02, 0.35)
    np.save(tmp_path / "seen.npy", drawn((3, 0.06, turn, at_m)))
    notes: list[str] = []
    arguments = str(SCRIPT.parent), str(tmp_path / "seen.npy"), str(written(tmp_path))
    with DriverPort(EPHEMERAL, "--objects", 1 << 20) as port:
        objects = RemoteObjects(port, {}, notes.append)
        with start("-c", PROGRAM, *arguments, port.endpoint) as sender:
            try:
                for _ in range(ROUNDS):
                    now_s = port.wait(0.005)
                    # From the first echo on both bounds of the age are known.
                    if objects.exchange(now_s) and now_s - objects.perceive(now_s).time_s < 0.4:
                        break
                    assert sender.poll() is None, sender.communicate()[1]
                else:
                    pytest.fail("no frame has echoed an answer")
                frame = objects.perceive(now_s)
            finally:
                sender.kill()
    assert (frame.names, frame.roles) == (("table", "target box"), (Role.SUPPORT, Role.TARGET))
    assert now_s - frame.time_s >= 0.05
    assert frame.sds_m is not None
    assert np.isnan(frame.sds_m[0])
    assert 0.0005 < frame.sds_m[1] < 0.01
    middle_m = box_in_world_m(turn, at_m).mean(axis=0)
    assert np.abs(frame.box_centers_m[0] - middle_m).max() < 3.0 * frame.sds_m[1]
    assert notes == []
