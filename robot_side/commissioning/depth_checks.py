"""Checks of depth cameras before anybody relies on them: what `feelahead doctor --depth` goes through."""

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from robot_side.commissioning.checklist import Check
from robot_side.commissioning.depth_figures import NEAR_M, PictureFigures
from robot_side.settings import RobotSettings

_LEAST_PER_S: Final = 5.0
_OLD_S: Final = 0.2
_HOLES: Final = 0.3
_FEW_POINTS: Final = 200
_SIGMAS: Final = 2.0
_ROD_M: Final = 0.005
_ROD_PIXELS: Final = 3
"""Pixels across a rod that surely has support: two whole ones beside an edge"""
_ROD_DEPTHS_M: Final = (0.3, 0.5, 1.0)


def depth_checks(
    name: str, pictures: Sequence[PictureFigures], seconds: float, settings: RobotSettings, *, arm_known: bool
) -> Iterator[Check]:
    """Judge the pictures that a camera took in some seconds; at least one.

    arm_known: whether the arm's readings say where it is; otherwise it is taken to stand as its model starts.
    """
    last, per_s = pictures[-1], len(pictures) / seconds
    said = f"{per_s:.0f} a second, {last.width} x {last.height} pixels"
    quick = per_s >= _LEAST_PER_S
    yield Check(f"{name}: pictures", quick, said, None if quick else f"send {_LEAST_PER_S:.0f} a second or more")
    # The first pictures come before any answer bounds their age.
    usual_s, oldest_s = np.quantile([picture.age_s for picture in pictures], (0.5, 0.95)).tolist()
    young = oldest_s <= _OLD_S
    yield Check(
        f"{name}: age",
        True if young else None,
        f"at most {1e3 * usual_s:.0f} ms in half of the pictures, {1e3 * oldest_s:.0f} ms in 95 %",
        None if young else "the camera's own stamp of the exposure, answers that are read at once, fewer pixels",
    )
    holes, out, alone = (
        float(np.mean([getattr(picture, share) for picture in pictures]))
        for share in ("holes", "out_of_range", "without_support")
    )
    filled = holes + out + alone <= _HOLES
    yield Check(
        f"{name}: holes",
        True if filled else None,
        f"{holes:.0%} of the pixels are empty, {out:.0%} out of range, {alone:.0%} without support",
        None if filled else "light, texture, the projector; unless nothing is within range there: holes are not felt",
    )
    yield _range(name, pictures)
    yield _mount(name, pictures, settings, arm_known=arm_known)
    yield _rods(name, last)


def _range(name: str, pictures: Sequence[PictureFigures]) -> Check:
    near_m, middle_m, far_m = np.median([picture.depths_m for picture in pictures], axis=0).tolist()
    errors = pictures[-1].errors
    allowed = f"{errors.least_m:g} to {errors.most_m:g} m count"
    if not np.isfinite(near_m):
        return Check(f"{name}: range", False, f"nothing is measured; {allowed}", "lens cap, light, distance")
    said = f"{near_m:.2f} to {far_m:.2f} m are measured; {allowed}; {1e3 * errors.sd_m(middle_m):.1f} mm is allowed for"
    good = errors.least_m <= middle_m <= errors.most_m
    remedy = "depth_unit_m, and --depth-camera.sensor"
    return Check(f"{name}: range", good, f"{said} at {middle_m:.2f} m", None if good else remedy)


def _mount(name: str, pictures: Sequence[PictureFigures], settings: RobotSettings, *, arm_known: bool) -> Check:
    what, beyond_m = f"{name}: mount", np.concatenate([picture.beyond_m for picture in pictures])
    where = "" if arm_known else "; the arm is taken to stand as its model starts"
    if len(beyond_m) < _FEW_POINTS * len(pictures) ** 0.5:
        said = f"only {len(beyond_m) / len(pictures):.0f} points a picture lie within {1e3 * NEAR_M:.0f} mm of the arm"
        remedy = "move the arm into the picture; if it is there and within range, the mount is wrong"
        return Check(what, None, said + where, remedy if arm_known else f"{remedy}, or give --arm")
    low_m, middle_m, high_m = np.quantile(beyond_m, (0.16, 0.5, 0.84)).tolist()
    spread_m = 0.5 * (high_m - low_m)
    said = f"the arm's own surface is {1e3 * middle_m:+.1f} mm off, with a spread of {1e3 * spread_m:.1f} mm"
    padding_m, allowed_m = settings.depth_map.padding_m, _SIGMAS * settings.camera.sd_m
    # A camera that is moved along a surface, or turned, shows in the spread alone.
    off_m = math.hypot(middle_m, spread_m)
    if off_m <= allowed_m:
        return Check(what, True if arm_known else None, said + where, None if arm_known else "give --arm")
    if off_m <= padding_m or not arm_known:
        remedy = f"calibrate the mount anew, or --camera.sd-m {off_m:.3f}"
        return Check(what, None, f"{said}; {1e3 * allowed_m:.0f} mm is allowed for{where}", remedy)
    said = f"{said}: more than the padding of {1e3 * padding_m:.0f} mm, so the arm warns of itself"
    return Check(what, False, said, "calibrate the mount anew (link, position_m, quaternion)")


def _rods(name: str, picture: PictureFigures) -> Check:
    errors, focal_px = picture.errors, min(picture.pinhole.fx, picture.pinhole.fy)
    least = [
        f"{1e3 * _ROD_PIXELS * depth_m / focal_px:.1f} mm at {depth_m:g} m"
        if errors.least_m <= depth_m <= errors.most_m
        else f"none at {depth_m:g} m"
        for depth_m in _ROD_DEPTHS_M
    ]
    until_m = _ROD_M * focal_px / _ROD_PIXELS
    good = until_m >= _ROD_DEPTHS_M[1]
    seen = "nowhere" if until_m < errors.least_m else f"up to {min(until_m, errors.most_m):.2f} m"
    said = f"thinnest with support: {', '.join(least)}; one of {1e3 * _ROD_M:.0f} mm is felt {seen}"
    return Check(f"{name}: rods", True if good else None, said, None if good else "more pixels, or a nearer camera")
