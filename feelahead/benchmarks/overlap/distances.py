"""What a user would pick instead of an overlap: the distance, from MuJoCo or coal, beside our overlap's time.

A distance says how near the nearest point is; the overlap of an enlarged sphere says how much is in the way, and
where.
"""

import importlib
import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np

from common.clock import Clock
from feelahead.benchmarks.overlap.pairs import Pairs
from feelahead.benchmarks.overlap.times.timing import nanoseconds_each, one_core
from feelahead.benchmarks.report import Report, Table, short

_CALLS = 2000


def measure_distances(report: Report, pairs: Pairs, repeats: int, clock: Clock) -> None:
    """Add the time of a distance between a sphere and a box, a call from Python each; `pairs` are boxes."""
    few = pairs[slice(0, min(_CALLS, len(pairs)))]
    rows = []
    for name, module, make in (
        ("MuJoCo mj_geomDistance", "mujoco", _mujoco_distance),
        ("coal distance", "coal", _coal_distance),
    ):
        if importlib.util.find_spec(module) is None:
            rows.append((f"{name}: not installed (pip install {'mujoco-core' if module == 'mujoco' else module})", ""))
            continue
        run = make(few)
        with one_core():
            time_ns = nanoseconds_each(run, len(few), repeats, clock)
        report.add("distance", name, "box", "partial", {"time": (time_ns, "ns/call")})
        rows.append((name, short(time_ns)))
    ours = report.value("speed", "ours, a call each", "box", "partial", "time")
    rows += [] if ours is None else [("our overlap, checked, a call each", short(ours))]
    ours = report.value("speed", "ours, kernel", "box", "partial", "time")
    rows += [] if ours is None else [("our overlap with gradient, kernel, batch", short(ours))]
    report.tables.append(
        Table(
            "A distance instead: sphere and box",
            ("method", "ns"),
            rows,
            "From Python, a call for each distance. Different questions: these rows are no ratio to win.",
        )
    )


def _mujoco_distance(pairs: Pairs) -> Callable[[], object]:
    """One sphere and one box of MuJoCo, moved for each call by writing their poses."""
    mujoco: Any = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom name='s' type='sphere' size='1'/>"
        "<geom name='b' type='box' size='1 1 1'/></worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    half_sizes = pairs.parameters[2]
    poses = list(zip(pairs.centers, pairs.radii.tolist(), half_sizes, pairs.parameters[0], strict=True))
    rotations = pairs.parameters[1].reshape(len(pairs), 9)
    segment = np.zeros(6)

    def run() -> object:
        total = 0.0
        for (center, radius, half, place), turn in zip(poses, rotations, strict=True):
            data.geom_xpos[0], model.geom_size[0, 0] = center, radius
            data.geom_xpos[1], data.geom_xmat[1], model.geom_size[1] = place, turn, half
            total += mujoco.mj_geomDistance(model, data, 0, 1, 1e3, segment)
        return total

    return run


def _coal_distance(pairs: Pairs) -> Callable[[], object]:
    coal: Any = importlib.import_module("coal")
    centers, rotations, half_sizes = pairs.parameters
    spheres = [coal.Sphere(radius) for radius in pairs.radii.tolist()]
    boxes = [coal.Box(2.0 * half) for half in half_sizes]
    places = [coal.Transform3s(np.eye(3), center) for center in pairs.centers]
    box_places = [coal.Transform3s(turn, center) for turn, center in zip(rotations, centers, strict=True)]
    request, result = coal.DistanceRequest(), coal.DistanceResult()

    def run() -> object:
        for sphere, place, box, box_place in zip(spheres, places, boxes, box_places, strict=True):
            result.clear()
            coal.distance(sphere, place, box, box_place, request, result)
        return result

    return run
