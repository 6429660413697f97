"""Seeded classes of spheres with tetrahedra and boxes on which overlap algorithms are known to fail."""

from collections.abc import Callable

import numpy as np

from common.arrays import FloatArray

CASES = 24
"""How many of each class."""

Rng = np.random.Generator
Tetrahedra = tuple[FloatArray, FloatArray, FloatArray]
Boxes = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


def _units(rng: Rng, *shape: int) -> FloatArray:
    vectors = rng.normal(size=(*shape, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _radii(rng: Rng) -> FloatArray:
    return np.asarray(np.exp(rng.uniform(np.log(0.3), np.log(3.0), CASES)))


def _eighths(values: FloatArray) -> FloatArray:
    """Rounded to multiples of 1/8, which leave most intermediate results exact."""
    return np.asarray(np.round(values * 8) / 8)


def _near(rng: Rng, points: FloatArray, radii: FloatArray, least: float, most: float) -> FloatArray:
    """Centres `least` to `most` radii away from `points`, in random directions."""
    distances = radii * rng.uniform(least, most, CASES)
    return np.asarray(points + distances[:, None] * _units(rng, CASES))


# Tetrahedra: (centers, radii, vertices). A feature has 1 vertex (a corner), 2 (an edge) or 3 (a face).


def _vertices(rng: Rng) -> FloatArray:
    return rng.normal(size=(CASES, 4, 3))


def _on_feature(rng: Rng, vertices: FloatArray, parts: int) -> FloatArray:
    weights = rng.exponential(size=(CASES, parts))
    weights /= weights.sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("nv,nvi->ni", weights, vertices[:, :parts]))


def _random(rng: Rng) -> Tetrahedra:
    return rng.normal(size=(CASES, 3)), _radii(rng), _vertices(rng)


def _binary(rng: Rng) -> Tetrahedra:
    return _eighths(rng.normal(size=(CASES, 3))), _eighths(_radii(rng)) + 0.125, _eighths(_vertices(rng))


def _inverted(rng: Rng) -> Tetrahedra:
    centers, radii, vertices = _random(rng)
    left_handed = np.linalg.det(vertices[:, 1:] - vertices[:, :1]) < 0.0
    vertices[~left_handed] = vertices[~left_handed][:, [0, 1, 3, 2]]
    return centers, radii, vertices


def _centered_on(parts: int) -> Callable[[Rng], Tetrahedra]:
    def make(rng: Rng) -> Tetrahedra:
        vertices = _vertices(rng)
        return _on_feature(rng, vertices, parts), _radii(rng), vertices

    return make


def _tangent_to(parts: int) -> Callable[[Rng], Tetrahedra]:
    """The surface passes through the feature, touching it from one side or the other."""

    def make(rng: Rng) -> Tetrahedra:
        vertices, radii = _vertices(rng), _radii(rng)
        away = rng.normal(size=(CASES, 3))
        for vertex in range(1, parts):
            along = vertices[:, vertex] - vertices[:, 0]
            if vertex == 2:
                first = vertices[:, 1] - vertices[:, 0]
                along = np.cross(np.cross(first, along), first)
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            away -= np.sum(away * along, axis=1, keepdims=True) * along
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        return _on_feature(rng, vertices, parts) + radii[:, None] * away, radii, vertices

    return make


def _corners_on_sphere(rng: Rng) -> Tetrahedra:
    centers, radii = rng.normal(size=(CASES, 3)), _radii(rng)
    return centers, radii, centers[:, None] + radii[:, None, None] * _units(rng, CASES, 4)


def _flat(thickness: float) -> Callable[[Rng], Tetrahedra]:
    def make(rng: Rng) -> Tetrahedra:
        vertices = _vertices(rng)
        vertices[:, 3] = _on_feature(rng, vertices, 3) + thickness * rng.normal(size=(CASES, 3))
        return vertices.mean(axis=1) + 0.5 * rng.normal(size=(CASES, 3)), _radii(rng), vertices

    return make


def _needle(thickness: float, ends: int) -> Callable[[Rng], Tetrahedra]:
    """All vertices near a line; `ends` of them within `thickness` of one of its ends."""

    def make(rng: Rng) -> Tetrahedra:
        vertices = _vertices(rng)
        fractions = rng.uniform(size=(CASES, 4, 1))
        fractions[:, 0], fractions[:, 1:ends], fractions[:, 3] = 0.0, 0.0, 1.0
        line = vertices[:, :1] + fractions * (vertices[:, 3:] - vertices[:, :1])
        vertices = line + thickness * rng.normal(size=(CASES, 4, 3))
        return vertices.mean(axis=1) + 0.5 * rng.normal(size=(CASES, 3)), _radii(rng), vertices

    return make


def _sized(ratio: float, parts: int) -> Callable[[Rng], Tetrahedra]:
    """Radii of about `ratio` times the tetrahedron's size, the surface near a feature of it."""

    def make(rng: Rng) -> Tetrahedra:
        vertices, radii = _vertices(rng), ratio * rng.uniform(0.5, 1.0, CASES)
        spread = min(1.0, 1.0 / ratio)
        centers = _near(rng, _on_feature(rng, vertices, parts), radii, 1.0 - spread, 1.0)
        return centers, radii, vertices

    return make


def _offset(rng: Rng) -> Tetrahedra:
    centers, radii, vertices = _random(rng)
    shift = 1e6 * rng.normal(size=(CASES, 1, 3))
    return centers + shift[:, 0], radii, vertices + shift


def _sliver(ratio: float, thickness: float) -> Callable[[Rng], Tetrahedra]:
    """Spheres of `ratio` at tetrahedra of `thickness`, whose faces and edges are much longer than they are apart."""

    def make(rng: Rng) -> Tetrahedra:
        vertices = _vertices(rng) * np.array([1.0, 1.0, thickness])
        weights = rng.dirichlet(np.full(4, 0.4), CASES)
        radii = ratio * _radii(rng)
        return _near(rng, np.einsum("nv,nvi->ni", weights, vertices), radii, 0.0, 1.0), radii, vertices

    return make


TETRAHEDRA: dict[str, Callable[[Rng], Tetrahedra]] = {
    "random": _random,
    "binary": _binary,
    "inverted": _inverted,
    "centre on vertex": _centered_on(1),
    "centre on edge": _centered_on(2),
    "centre on face": _centered_on(3),
    "surface on vertex": _tangent_to(1),
    "tangent edge": _tangent_to(2),
    "tangent face": _tangent_to(3),
    "corners on sphere": _corners_on_sphere,
    **{f"flat {t:g}": _flat(t) for t in (1e-3, 1e-8, 1e-14)},
    **{f"needle {t:g}": _needle(t, 1) for t in (1e-3, 1e-8, 1e-14)},
    **{f"spike {t:g}": _needle(t, 3) for t in (1e-3, 1e-8, 1e-14)},
    **{f"R/L {r:g} on {p}": _sized(r, p) for r in (1e-3, 1e-2, 0.1, 10.0, 100.0, 1e3) for p in (1, 2, 3)},
    **{f"R/L {r:g}, {t:g} thick": _sliver(r, t) for r in (1e-6, 1e-4, 1e-2, 0.1) for t in (1.0, 0.1, 1e-2, 1e-4)},
    "offset 1e6": _offset,
}


# Boxes: (centers, radii, box centers, rotations, half sizes). A feature fixes 1 coordinate (a face) to 3.


def _new_boxes(rng: Rng) -> tuple[FloatArray, FloatArray, FloatArray]:
    rotations = np.array([np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(CASES)])
    return rng.normal(size=(CASES, 3)), rotations, rng.uniform(0.2, 1.5, (CASES, 3))


def _random_boxes(rng: Rng) -> Boxes:
    return rng.normal(size=(CASES, 3)), _radii(rng), *_new_boxes(rng)


def _single_precision_boxes(rng: Rng) -> Boxes:
    centers, radii, boxes, rotations, half_sizes = _random_boxes(rng)
    return centers, radii, boxes, rotations.astype(np.float32).astype(np.float64), half_sizes


def _binary_boxes(rng: Rng) -> Boxes:
    centers, radii, boxes, _, half_sizes = _random_boxes(rng)
    upright = np.tile(np.eye(3), (CASES, 1, 1))
    return _eighths(centers), _eighths(radii) + 0.125, _eighths(boxes), upright, _eighths(half_sizes) + 0.125


def _surface_at(fixed: int, ratio: float | None, least: float, most: float) -> Callable[[Rng], Boxes]:
    """Centres `least` to `most` radii outward (inward when negative) from a point of a feature."""

    def make(rng: Rng) -> Boxes:
        boxes, rotations, half_sizes = _new_boxes(rng)
        radii = _radii(rng) if ratio is None else ratio * rng.uniform(0.5, 1.0, CASES)
        place, away = rng.uniform(-1.0, 1.0, (CASES, 3)), np.zeros((CASES, 3))
        place[:, :fixed] = rng.choice((-1.0, 1.0), (CASES, fixed))
        away[:, :fixed] = place[:, :fixed] * rng.uniform(0.2, 1.0, (CASES, fixed))
        away *= (radii * rng.uniform(least, most, CASES) / np.linalg.norm(away, axis=1))[:, None]
        centers = boxes + np.einsum("nij,nj->ni", rotations, half_sizes * place + away)
        return centers, radii, boxes, rotations, half_sizes

    return make


def _thin_boxes(thickness: float, axes: int) -> Callable[[Rng], Boxes]:
    def make(rng: Rng) -> Boxes:
        boxes, rotations, half_sizes = _new_boxes(rng)
        half_sizes[:, :axes] *= thickness
        return boxes + 0.3 * rng.normal(size=(CASES, 3)), _radii(rng), boxes, rotations, half_sizes

    return make


FEATURES = {1: "face", 2: "edge", 3: "vertex"}
BOXES: dict[str, Callable[[Rng], Boxes]] = {
    "random": _random_boxes,
    "single precision": _single_precision_boxes,
    "binary": _binary_boxes,
    **{f"centre on {name}": _surface_at(fixed, None, 0.0, 0.0) for fixed, name in FEATURES.items()},
    **{f"tangent {name} outside": _surface_at(fixed, None, 1.0, 1.0) for fixed, name in FEATURES.items()},
    **{f"tangent {name} inside": _surface_at(fixed, None, -1.0, -1.0) for fixed, name in FEATURES.items()},
    **{f"flat {t:g}": _thin_boxes(t, 1) for t in (1e-3, 1e-8, 1e-14)},
    **{f"needle {t:g}": _thin_boxes(t, 2) for t in (1e-3, 1e-8, 1e-14)},
    **{
        f"R/L {ratio:g} {name}": _surface_at(fixed, ratio, -1.0, 1.0)
        for ratio in (1e-3, 1e-2, 0.1)
        for fixed, name in FEATURES.items()
    },
    **{
        f"R/L {ratio:g} {name}": _surface_at(fixed, ratio, 1.0 - 1.0 / ratio, 1.0)
        for ratio in (10.0, 100.0, 1e3)
        for fixed, name in FEATURES.items()
    },
}
