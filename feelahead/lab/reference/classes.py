"""Frozen classes of pairs, drawn from a seed, on which overlap algorithms are known to fail.

Each class comes in two kinds: with general doubles, and on a grid where every coordinate is a short binary number, so
that contacts are exact. The same seed and count give the same pairs.
"""

import functools
import zlib
from collections.abc import Callable, Iterable
from typing import Concatenate, ParamSpec

import numpy as np

from common.arrays import FloatArray
from feelahead.lab.reference.features import (
    FEATURES,
    Rng,
    boxes,
    points,
    radii,
    rotations,
    tetrahedra,
    unit_vectors,
)
from feelahead.lab.reference.pairs import Pairs

Maker = Callable[[Rng, int, bool], Pairs]
"""Function that makes pairs of one class, from (random generator, count, whether on the grid)."""

_Parameters = ParamSpec("_Parameters")


def _maker(draw: Callable[Concatenate[Rng, int, bool, _Parameters], Pairs]) -> Callable[_Parameters, Maker]:
    """Turn a function of (random generator, count, grid, parameters) into one from the parameters to a maker."""

    @functools.wraps(draw)
    def of(*given: _Parameters.args, **named: _Parameters.kwargs) -> Maker:
        return lambda rng, count, grid: draw(rng, count, grid, *given, **named)

    return of


DEPTHS = {"1e-3": 2.0**-10, "1e-6": 2.0**-20, "1e-9": 2.0**-30}
"""Depths of tiny overlaps, in radii; they are powers of two, which are exact on the grid."""
THIN = {"1e-3": 2.0**-10, "1e-8": 2.0**-27, "1e-14": 2.0**-46}
"""Thicknesses of flat and needle-like solids, relative to their size."""
RATIOS = {f"1e{power}": 2.0 ** round(power * np.log2(10.0)) for power in (-6, -4, -2, -1, 1, 2, 4, 6)}
"""Sphere radii in units of the solid's size."""
SOLIDS = ("tetrahedron", "box", "half-space", "sphere")
FAR = 2.0**20
"""Offset of both sphere and solid from the origin, about 1e6 m."""


_FAMILIES = {
    "depth": "tiny overlap",
    "offset": "offset 1e6",
    "inverted": "inverted",
    "without volume": "without volume",
    "flat": "flat or needle",
    "needle": "flat or needle",
    "R/L 1e-": "R/L below 1",
    "ratio 1e-": "R/L below 1",
    "R/L": "R/L above 1",
    "ratio": "R/L above 1",
    "tangent": "tangent",
    "centre on": "centre on, or corners on",
    "corners on": "centre on, or corners on",
    "far": "far or swallowed",
    "swallowed": "far or swallowed",
}


def family(name: str) -> str:
    """Return the group in which results of a class are shown. name: the class's full name in `frozen_classes`."""
    return next((shown for part, shown in _FAMILIES.items() if part in name), "random")


def frozen_class(solid: str, name: str, count: int, *, grid: bool = False, seed: int = 0) -> tuple[str, Pairs]:
    """Make `count` pairs of one class; the full name is `solid, class, general or grid`."""
    rng = np.random.default_rng([seed, grid, zlib.crc32(f"{solid} {name}".encode())])
    return f"{solid}, {name}, {'grid' if grid else 'general'}", MAKERS[solid][name](rng, count, grid)


def frozen_classes(count: int, seed: int = 0, solids: Iterable[str] = SOLIDS) -> dict[str, Pairs]:
    """Make `count` pairs of each class of these solids; return them by the classes' full names."""
    return dict(
        frozen_class(solid, name, count, grid=grid, seed=seed)
        for solid in solids
        for name in MAKERS[solid]
        for grid in (False, True)
    )


def _tetrahedron(centers: FloatArray, sizes: FloatArray, vertices: FloatArray) -> Pairs:
    return Pairs("tetrahedron", centers, sizes, (vertices,))


@_maker
def touching(rng: Rng, count: int, grid: bool, solid: str, feature: str, depth: float, *, swell: float = 1.0) -> Pairs:
    """Draw spheres that reach `depth` radii into a solid at a face, edge or vertex. swell: scales radii.

    A depth of 1 puts the sphere's centre on the feature, a depth of 2 puts the whole sphere on its inner side.
    """
    if solid == "tetrahedron":
        vertices, contact = tetrahedra(rng, count, feature, grid=grid)
        parameters: tuple[FloatArray, ...] = (vertices,)
    else:
        parameters, contact = boxes(rng, count, feature, grid=grid)
    centers, sizes = contact.spheres(swell * radii(rng, count, grid=grid), depth)
    return Pairs("tetrahedron" if solid == "tetrahedron" else "box", centers, sizes, parameters)


@_maker
def _large_or_small(rng: Rng, count: int, grid: bool, solid: str, ratio: float) -> Pairs:
    """Draw spheres with `ratio` times the solid's size, whose surfaces pass close to a feature."""
    feature = str(rng.choice(list(FEATURES)))
    depth = min(1.0, 1.0 / ratio) * (0.5 if grid else float(rng.uniform(0.1, 1.0)))
    return touching(solid, feature, depth, swell=ratio)(rng, count, grid)


def _random_tetrahedra(rng: Rng, count: int, grid: bool) -> Pairs:
    return _tetrahedron(points(rng, count, grid=grid), radii(rng, count, grid=grid), points(rng, count, 4, grid=grid))


def _inverted(rng: Rng, count: int, grid: bool) -> Pairs:
    pairs = _random_tetrahedra(rng, count, grid)
    vertices = pairs.parameters[0]
    right_handed = np.linalg.det(vertices[:, 1:] - vertices[:, :1]) > 0.0
    vertices[right_handed] = vertices[right_handed][:, [0, 1, 3, 2]]
    return pairs


def _corners_on_sphere(rng: Rng, count: int, grid: bool) -> Pairs:
    centers, sizes = points(rng, count, grid=grid), radii(rng, count, grid=grid)
    if not grid:
        directions = unit_vectors(rng, 4 * count).reshape(count, 4, 3)
        return _tetrahedron(centers, sizes, centers[:, None] + sizes[:, None, None] * directions)
    # 9² = 1² + 4² + 8² = 4² + 4² + 7² puts whole corners on a sphere of radius 9 exactly.
    whole = np.array([(1, 4, 8), (4, 4, 7), (0, 0, 9), (8, 4, 1), (7, 4, 4), (4, 8, 1)], float)
    chosen = whole[rng.integers(0, len(whole), (count, 4))] * rng.choice((-1.0, 1.0), (count, 4, 3))
    return _tetrahedron(centers, 9.0 * sizes, centers[:, None] + sizes[:, None, None] * chosen)


@_maker
def _flat(rng: Rng, count: int, grid: bool, thickness: float) -> Pairs:
    vertices = points(rng, count, 4, grid=grid)
    if grid:
        vertices[:, :, 2] = vertices[:, :1, 2]
        vertices[:, 3, 2] += thickness
    else:
        weights = rng.dirichlet(np.ones(3), count)
        on_plane = np.einsum("nv,nvi->ni", weights, vertices[:, :3])
        vertices[:, 3] = on_plane + thickness * rng.normal(size=(count, 3))
    middle = vertices.mean(axis=1) if not grid else vertices[:, 0]
    return _tetrahedron(middle + 0.5 * points(rng, count, grid=grid), radii(rng, count, grid=grid), vertices)


@_maker
def _sliver(rng: Rng, count: int, grid: bool, ratio: float) -> Pairs:
    """Draw small spheres at slivers: tetrahedra whose faces and edges lie close to each other."""
    thin = 2.0 ** -rng.integers(0, 14, count)
    vertices = points(rng, count, 4, grid=grid)
    vertices[:, :, 2] *= thin[:, None]
    shares = np.array([0.5, 0.25, 0.25, 0.0]) if grid else rng.dirichlet(np.full(4, 0.4), count)[:, :, None]
    middle = np.tensordot(shares, vertices, (0, 1)) if grid else (shares * vertices).sum(axis=1)
    sizes = ratio * radii(rng, count, grid=grid)
    return _tetrahedron(middle + 0.5 * sizes[:, None] * points(rng, count, grid=grid), sizes, vertices)


@_maker
def _needle(rng: Rng, count: int, grid: bool, thickness: float, *, spike: bool = False) -> Pairs:
    """Draw needles: all vertices within `thickness` of a line; a `spike` has three near one end."""
    start, along = points(rng, count, grid=grid), points(rng, count, grid=grid)
    fractions = rng.integers(0, 5, (count, 4, 1)) / 4.0
    if spike:
        fractions[:, :3], fractions[:, 3] = 0.0, 1.0
    vertices = start[:, None] + fractions * along[:, None] + thickness * points(rng, count, 4, grid=grid)
    return _tetrahedron(start + 0.5 * along, radii(rng, count, grid=grid), vertices)


def _without_volume(rng: Rng, count: int, grid: bool) -> Pairs:
    """Make tetrahedra without volume: one vertex occurs twice, or on the grid all four lie in a plane."""
    pairs = _random_tetrahedra(rng, count, grid)
    vertices = pairs.parameters[0]
    if grid:
        vertices[:, 3] = vertices[:, 1] + vertices[:, 2] - vertices[:, 0]
    else:
        vertices[:, 3] = vertices[:, 1]
    return pairs


@_maker
def shifted(rng: Rng, count: int, grid: bool, make: Maker) -> Pairs:
    """Draw pairs by `make`, shifted far from the origin, where neighbouring doubles are 1e-10 m apart."""
    pairs = make(rng, count, grid)
    shift = FAR * (rng.choice((-1.0, 1.0), (count, 3)) if grid else rng.normal(size=(count, 3)))
    place, *rest = pairs.parameters
    moved = place + (shift[:, None] if pairs.solid == "tetrahedron" else shift)
    return Pairs(pairs.solid, pairs.centers + shift, pairs.radii, (moved, *rest))


def _random_boxes(rng: Rng, count: int, grid: bool) -> Pairs:
    parameters, _ = boxes(rng, count, "face", grid=grid)
    return Pairs("box", points(rng, count, grid=grid), radii(rng, count, grid=grid), parameters)


def _single_precision(rng: Rng, count: int, grid: bool) -> Pairs:
    pairs = _random_boxes(rng, count, grid)
    place, turn, half_sizes = pairs.parameters
    return Pairs("box", pairs.centers, pairs.radii, (place, turn.astype(np.float32).astype(float), half_sizes))


@_maker
def _thin_boxes(rng: Rng, count: int, grid: bool, thickness: float, axes: int) -> Pairs:
    pairs = _random_boxes(rng, count, grid)
    pairs.parameters[2][:, :axes] *= thickness
    return Pairs("box", pairs.parameters[0] + 0.25 * pairs.centers, pairs.radii, pairs.parameters)


@_maker
def half_spaces(rng: Rng, count: int, grid: bool, depth: float | None) -> Pairs:
    """Draw spheres that reach `depth` radii into a half-space; None: random depths."""
    sizes, offsets = radii(rng, count, grid=grid), points(rng, count, grid=grid)[:, 0]
    normals = rotations(rng, count, grid=True)[:, 0] if grid else unit_vectors(rng, count)
    reached = depth if depth is not None else rng.integers(-4, 20, count) / 8.0
    heights = offsets + (1.0 - reached) * sizes
    return Pairs("half-space", heights[:, None] * normals, sizes, (normals, offsets))


@_maker
def spheres(rng: Rng, count: int, grid: bool, depth: float | None, ratio: float = 1.0) -> Pairs:
    """Draw spheres that reach `depth` radii (None: random) into spheres of 1 / `ratio` of their size."""
    sizes = ratio * radii(rng, count, grid=grid)
    others, other_sizes = points(rng, count, grid=grid), radii(rng, count, grid=grid)
    steps = rotations(rng, count, grid=True)[:, 0] if grid else unit_vectors(rng, count)
    reached = depth if depth is not None else rng.integers(-4, 20, count) / 8.0
    distances = other_sizes + sizes - reached * np.minimum(sizes, other_sizes)
    return Pairs("sphere", others + distances[:, None] * steps, sizes, (others, other_sizes))


def _features(solid: str) -> dict[str, Maker]:
    """Return the classes common to tetrahedra and boxes."""
    return {
        **{f"centre on {feature}": touching(solid, feature, 1.0) for feature in FEATURES},
        **{f"tangent {feature}": touching(solid, feature, 0.0) for feature in FEATURES},
        "tangent inside": touching(solid, "face", 2.0, swell=0.25),
        **{
            f"{feature} depth {name}": touching(solid, feature, depth)
            for feature in FEATURES
            for name, depth in DEPTHS.items()
        },
        **{f"R/L {name}": _large_or_small(solid, ratio) for name, ratio in RATIOS.items()},
        "offset 1e6, tangent": shifted(touching(solid, "edge", 0.0)),
        "far away": touching(solid, "face", -4.0),
        "solid swallowed": touching(solid, "vertex", 1.0, swell=16.0),
        "sphere swallowed": touching(solid, "face", 4.0, swell=2.0**-6),
    }


MAKERS: dict[str, dict[str, Maker]] = {
    "tetrahedron": {
        "random": _random_tetrahedra,
        "inverted": _inverted,
        "corners on sphere": _corners_on_sphere,
        "without volume": _without_volume,
        **{f"flat {name}": _flat(thickness) for name, thickness in THIN.items()},
        **{f"needle {name}": _needle(thickness) for name, thickness in THIN.items()},
        **{f"needle {name}, spike": _needle(thickness, spike=True) for name, thickness in THIN.items()},
        **{f"R/L {name}, sliver": _sliver(RATIOS[name]) for name in ("1e-1", "1e-2", "1e-4", "1e-6")},
        "offset 1e6": shifted(_random_tetrahedra),
        **_features("tetrahedron"),
    },
    "box": {
        "random": _random_boxes,
        "single precision": _single_precision,
        "without volume": _thin_boxes(0.0, 1),
        **{f"flat {name}": _thin_boxes(thickness, 1) for name, thickness in THIN.items()},
        **{f"needle {name}": _thin_boxes(thickness, 2) for name, thickness in THIN.items()},
        "offset 1e6": shifted(_random_boxes),
        **_features("box"),
    },
    "half-space": {
        "random": half_spaces(None),
        "centre on plane": half_spaces(1.0),
        "tangent": half_spaces(0.0),
        "tangent inside": half_spaces(2.0),
        **{f"depth {name}": half_spaces(depth) for name, depth in DEPTHS.items()},
    },
    "sphere": {
        "random": spheres(None),
        "tangent": spheres(0.0),
        "tangent inside": spheres(2.0),
        **{f"depth {name}": spheres(depth) for name, depth in DEPTHS.items()},
        **{f"ratio {name}": spheres(0.5, ratio) for name, ratio in RATIOS.items()},
    },
}
