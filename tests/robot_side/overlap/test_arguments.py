"""Arguments of the public functions: shapes, broadcasting and errors; and those of the unchecked kernels."""

import re
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_side.overlap import kernels, sphere_box, sphere_half_space, sphere_sphere, sphere_tetrahedron, volumes

CORNER = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])

Call = tuple[Callable[..., Any], dict[str, Any]]
CALLS: dict[str, Call] = {
    "sphere": (
        sphere_sphere,
        {"centers": np.zeros((2, 3)), "radii": np.ones(2), "other_centers": np.ones((2, 3)), "other_radii": np.ones(2)},
    ),
    "half-space": (
        sphere_half_space,
        {"centers": np.zeros((2, 3)), "radii": np.ones(2), "normals": np.eye(3)[:2], "offsets": np.zeros(2)},
    ),
    "box": (
        sphere_box,
        {
            "centers": np.zeros((2, 3)),
            "radii": np.ones(2),
            "box_centers": np.ones((2, 3)),
            "box_rotations": np.array([np.eye(3), np.eye(3)]),
            "box_half_sizes": np.ones((2, 3)),
        },
    ),
    "tetrahedron": (
        sphere_tetrahedron,
        {"centers": np.zeros((2, 3)), "radii": np.ones(2), "vertices": np.array([CORNER, CORNER])},
    ),
}
ARGUMENTS = [(kind, name) for kind, (_, arguments) in CALLS.items() for name in arguments]


def changed(kind: str, name: str, value: object) -> Callable[[], Any]:
    function, arguments = CALLS[kind]
    return lambda: function(**{**arguments, name: value})


@pytest.mark.parametrize("kind", CALLS)
def test_results_have_the_leading_dimensions(kind: str) -> None:
    function, arguments = CALLS[kind]
    found = function(**arguments)
    assert found.shape == (2,)
    assert found.dtype == np.float64
    with_gradient = function(**arguments, gradient=True)
    assert [result.shape for result in with_gradient] == [(2,), (2, 3), (2,)]
    np.testing.assert_array_equal(with_gradient[0], found)

    one = function(**{name: value[0] for name, value in arguments.items()})
    assert one.shape == ()
    assert one == found[0]
    none = function(**{name: value[:0] for name, value in arguments.items()}, gradient=True)
    assert [result.shape for result in none] == [(0,), (0, 3), (0,)]


@pytest.mark.parametrize("kind", CALLS)
def test_leading_dimensions_broadcast(kind: str) -> None:
    function, arguments = CALLS[kind]
    rng = np.random.default_rng(5)
    centers, radii = 0.3 * rng.normal(size=(4, 1, 3)), rng.uniform(0.5, 1.0, (4, 1))
    table = function(**{**arguments, "centers": centers, "radii": radii}, gradient=True)
    assert [result.shape for result in table] == [(4, 2), (4, 2, 3), (4, 2)]
    for row in range(4):
        for column in range(2):
            single = {name: value[column] for name, value in arguments.items()}
            single |= {"centers": centers[row, 0], "radii": radii[row, 0]}
            for result, expected in zip(table, function(**single, gradient=True), strict=True):
                np.testing.assert_array_equal(result[row, column], expected)


@pytest.mark.parametrize("kind", CALLS)
@pytest.mark.parametrize("most", [1, 4, 6, 29, 59])
def test_many_pairs_are_overlapped_in_blocks(kind: str, most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    function, arguments = CALLS[kind]
    rng = np.random.default_rng(6)
    spheres = {"centers": 0.3 * rng.normal(size=(5, 3, 1, 2, 3)), "radii": rng.uniform(0.5, 1.0, (1, 2, 1))}
    whole = function(**{**arguments, **spheres}, gradient=True)
    assert whole[0].shape == (5, 3, 2, 2)
    monkeypatch.setattr(volumes, "MOST_AT_ONCE", most)
    for result, expected in zip(function(**{**arguments, **spheres}, gradient=True), whole, strict=True):
        np.testing.assert_array_equal(result, expected)
    np.testing.assert_array_equal(function(**{**arguments, **spheres}), whole[0])
    plain = {name: np.repeat(value[:1], 60, axis=0) for name, value in arguments.items()}
    np.testing.assert_array_equal(function(**plain), np.full(60, function(**arguments)[0]))


def test_memory_grows_with_the_results_alone() -> None:
    others = np.random.default_rng(7).normal(size=(2, 2000, 3))
    sphere_sphere(others[0], 0.1, others[1], 0.1)
    tracemalloc.start()
    volumes_m3 = sphere_sphere(others[0, :, None], 0.1, others[1], 0.1)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < volumes_m3.nbytes + 40e6


@given(st.sampled_from(ARGUMENTS), st.integers(1, 150), st.data())
def test_one_bad_number_among_many_is_found(argument: tuple[str, str], count: int, data: st.DataObject) -> None:
    kind, name = argument
    function, arguments = CALLS[kind]
    many = {key: np.repeat(value[:1], count, axis=0) for key, value in arguments.items()}
    function(**many)
    place = tuple(data.draw(st.integers(0, size - 1)) for size in many[name].shape)
    many[name][place] = data.draw(st.sampled_from([np.nan, np.inf, -np.inf, -1.1e50, 1e51]))
    said = f"{name}[{', '.join(map(str, place))}] = {many[name][place]} is out of range; valid: finite"
    with pytest.raises(ValueError, match=re.escape(said)):
        function(**many)


@pytest.mark.parametrize("kind", CALLS)
def test_numbers_at_their_limits_are_in_range(kind: str) -> None:
    function, arguments = CALLS[kind]
    far = np.full((2, 3), 1e50)
    assert function(**{**arguments, "centers": far}) == pytest.approx(0.0)
    radii = np.full(2, 1e50)
    volumes, gradients, areas = function(**{**arguments, "radii": radii}, gradient=True)
    expected = function(**{**arguments, "radii": radii * (1.0 - 2.0**-52)}, gradient=True)
    for result, near in zip((volumes, gradients, areas), expected, strict=True):
        np.testing.assert_allclose(result, near, rtol=1e-14, atol=1e-60)


def test_bad_unvouched_numbers_are_doubtful() -> None:
    rng = np.random.default_rng(9)
    centers, vertices = rng.normal(size=(200, 3)), rng.normal(size=(200, 4, 3))
    kernels.tetrahedron_pairs(centers, np.ones(200), vertices, trusted=False)
    radii = np.ones(200)
    radii[150] = -1.0
    with pytest.raises(kernels.DoubtfulNumbersError):
        kernels.tetrahedron_pairs(centers, radii, vertices, trusted=False)


@pytest.mark.parametrize(("kind", "name"), ARGUMENTS)
def test_wrong_shapes_are_refused(kind: str, name: str) -> None:
    value = CALLS[kind][1][name]
    if value.ndim > 1:
        with pytest.raises(ValueError, match=rf"^{name} has the shape \(2, .*; valid: the shape \(\.\.\., "):
            changed(kind, name, value[..., :-1])()
        with pytest.raises(ValueError, match=rf"^{name} has the shape \(\); valid"):
            changed(kind, name, 1.0)()
    three = np.concatenate([value, value[:1]])
    with pytest.raises(ValueError, match=rf"do not broadcast: .*{name} \(3"):
        changed(kind, name, three)()


@pytest.mark.parametrize(
    ("kind", "name", "value", "said"),
    [
        ("sphere", "radii", [1.0, -0.25], r"\[1\] = -0\.25 is out of range; valid: finite, 0 to 1e\+50 m$"),
        ("box", "box_half_sizes", [[1.0] * 3, [-0.25] * 3], r"\[1, 0\] = -0\.25 is out of range; valid: finite, 0 to"),
        ("sphere", "radii", "far", " has the type .*; valid: real numbers"),
        ("sphere", "radii", True, " has the type .*; valid: real numbers"),
        (
            "tetrahedron",
            "vertices",
            [[0, 0, 0], [1, 0]],
            r" is no rectangular array; valid: the shape \(\.\.\., 4, 3\)",
        ),
        (
            *("half-space", "normals", [[0.0, 0.0, 2.0], [0.0, 0.0, 0.0]]),
            r"\[1\] = \[0\.0, 0\.0, 0\.0\] is out of range; valid: a vector",
        ),
        ("box", "box_rotations", 2.0 * np.eye(3), r" = \[\[.*\]\] is out of range; valid: an orthonormal"),
    ],
)
def test_what_is_refused(kind: str, name: str, value: object, said: str) -> None:
    with pytest.raises(ValueError, match=f"^{name}{said}"):
        changed(kind, name, value)()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rotations_are_orthonormal_to_a_millionth_and_no_further(sign: float) -> None:
    arguments = {**CALLS["box"][1], "centers": np.zeros((2, 3))}
    shear = sign * np.eye(3, k=2)
    # Two numbers off the diagonal of QᵀQ are the shear; all others of QᵀQ - I are almost 0.
    for share, refused in ((0.98, False), (0.999, False), (1.001, True)):
        turned = np.array([np.eye(3), np.eye(3) + share * 1e-6 / np.sqrt(2.0) * shear])
        if refused:
            with pytest.raises(ValueError, match=r"^box_rotations\[1\] = .* an orthonormal matrix"):
                sphere_box(**{**arguments, "box_rotations": turned})
        else:
            sphere_box(**{**arguments, "box_rotations": turned})


def test_a_rotation_within_its_tolerance_gives_the_set_that_it_describes() -> None:
    skewed = np.eye(3) + 4e-7 * np.eye(3, k=1)
    stretched = np.diag([1.0 + 4e-7, 1.0, 1.0])
    for rotation in (skewed, stretched, -stretched):
        inside = sphere_box((0, 0, 0), 9.0, (0, 0, 0), rotation, (1, 2, 3))
        assert inside == pytest.approx(48.0 * abs(np.linalg.det(rotation)), rel=1e-15)


def test_flat_solids_and_points_give_nothing() -> None:
    for vertices in (CORNER[[0, 1, 2, 1]], np.zeros((4, 3)), CORNER * [1.0, 1.0, 0.0], CORNER[[0, 1, 1, 2]]):
        for result in sphere_tetrahedron((0.25, 0.25, 0.0), 0.5, vertices, gradient=True):
            assert not result.any()
    for result in sphere_box((0, 0, 0), 1.0, (0, 0, 0), np.eye(3), (1.0, 0.0, 1.0), gradient=True):
        assert not result.any()
    for function, arguments in CALLS.values():
        for result in function(**{**arguments, "radii": 0.0}, gradient=True):
            assert not result.any()
