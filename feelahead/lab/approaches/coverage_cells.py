"""Cells of `bench coverage`: motions, scenes and errors for which coverage and false alarms are judged."""

from collections.abc import Iterator
from typing import Final

from feelahead.lab.approaches.evaluation import LINKS, Placement
from feelahead.lab.approaches.frozen import AHEAD, PASSED
from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind
from robot_side.depth.camera_settings import DepthCameraSettings, Eyes

Cells = Iterator[tuple[PullKind, str, Placement]]
_NOT_STILL: Final = ("moving", "fleeing", "place_held", "terrain_ahead")
"""Scenes that only `try approach` uses: objects that move by themselves or with the gripper, and a hill."""
_BY_DEPTH: Final = ("wall", "ball", "post", "rod_5mm", "rod_10mm", "mug", "shelf_edge", "slot", "table_1_box")
_EYES: Final[tuple[Eyes, ...]] = ("fixed", "wrist", "both")
_MOUNT_M: Final = 0.002
_RATE_HZ: Final = 15.0
"""Half of what the cameras give, as each picture takes a processor 20 ms"""


def full_cells() -> Cells:
    """Yield all cells: every scene with a steady pull over four links, every pull over two links, then single changes.

    The single changes are drifts and turns in more scenes, and objects that come nearer or go away.
    """
    yield from (("steady", link, Placement("wall")) for link in LINKS)
    still = [name for name in (*AHEAD, *PASSED) if name not in _NOT_STILL]
    yield from (("steady", link, Placement(name)) for link in ("0 ms", "50 ms", "200 ms", "400 ms") for name in still)
    for link in ("50 ms", "200 ms"):
        for pull in PULL_KINDS:
            for name in ("wall", "post", "rod_5mm", "wall_beside", "table_1_box", "cluttered"):
                yield pull, link, Placement(name)
        for name in ("plate", "ball", "slot", "u_mesh", "mug"):
            yield "drift", link, Placement(name)
            yield "yaw", link, Placement(name)
        yield "drift", link, Placement("edge")
        yield "yaw", link, Placement("turn")
        yield from (("bell", link, Placement(name, speed_m_s=v)) for name in ("wall", "ball") for v in (-0.06, 0.03))
        yield from (("bell", link, Placement("wall", camera_mm)) for camera_mm in (1.0, 6.0))
    yield "bell", "200 ms", Placement("wall", encoder_factor=10.0)


def quick_cells() -> Cells:
    """Yield the few cells of --quick, which show whether anything is wrong."""
    for name in ("wall", "rod_5mm", "wall_beside", "table_1_box"):
        yield "steady", "50 ms", Placement(name)
        yield "bell", "200 ms", Placement(name)


def depth_cells(*, quick: bool) -> Cells:
    """Yield the cells of --perception depth: every scene and choice of cameras, then other noise and other mounts.

    Each scene is also judged with the objects themselves perceived, for comparison.
    """
    scenes = ("wall", "ball", "post", "rod_5mm", "mug", "slot", "shelf_edge") if quick else _BY_DEPTH
    for name in scenes:
        yield "bell", "50 ms", Placement(name)
        for eyes in _EYES:
            errors = (
                [(1.0, _MOUNT_M)]
                if quick
                else [(1.0, _MOUNT_M), (0.0, _MOUNT_M), (2.0, _MOUNT_M), (1.0, 0.0), (1.0, 0.006)]
            )
            for noise, mount_error_m in errors:
                depth = _cameras(eyes, noise, mount_error_m)
                yield "bell", "50 ms", Placement(name, depth=depth)
    for name, speed_m_s in (("ball", -0.06), ("hand", -0.15)):
        yield "bell", "50 ms", Placement(name, speed_m_s=speed_m_s)
        for eyes in _EYES:
            depth = _cameras(eyes, 1.0, _MOUNT_M)
            yield "bell", "50 ms", Placement(name, speed_m_s=speed_m_s, depth=depth)


def _cameras(eyes: Eyes, noise: float, mount_error_m: float) -> DepthCameraSettings:
    return DepthCameraSettings(eyes=eyes, noise=noise, mount_error_m=mount_error_m, labels=False, rate_hz=_RATE_HZ)
