"""`feelahead bench overlap` with its smallest grid, and the methods that it compares."""

import csv
import math
import shutil
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from feelahead.lab.questions.overlap import HEADER, KERNEL, OURS, QUESTION, OverlapSweep, goals
from feelahead.lab.reference import published
from feelahead.lab.reference.approximations import monte_carlo, satellite_points, satellites
from feelahead.lab.reference.classes import frozen_class
from feelahead.lab.reference.errors import kernel_volumes
from feelahead.lab.reference.pairs import Pairs
from feelahead.lab.reference.published import CompiledHeader, package_corners
from feelahead.lab.sweep import ask
from feelahead.lab.table import Row, Table

SMALL = ("--quick", "--adversarial", "200", "--truths", "2", "--timed", "100")
FAKE_HEADER = """
#pragma once
#include <array>
#include <stdexcept>
namespace overlap {
struct Vector { double x, y, z; };
struct Sphere { Sphere(Vector c, double r) : center(c), radius(r) {} Vector center; double radius; };
template<int N> struct Element {
  explicit Element(std::array<Vector, N> v) : vertices(v) {}
  std::array<Vector, N> vertices;
};
using Tetrahedron = Element<4>;
using Hexahedron = Element<8>;
template<int N> double overlap_volume(const Sphere& s, const Element<N>& e) {
  if (s.radius > 99) throw std::invalid_argument{"too large"};
  return s.center.x + 10 * s.radius + 100 * e.vertices[0].y + 1000 * e.vertices[N - 1].z;
}
}
"""


@pytest.mark.long
def test_the_command_prints_its_goals_and_writes_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written, picture = tmp_path / "out.csv", tmp_path / "out.png"
    summary = tmp_path / "out.json"

    def few(asked: OverlapSweep) -> Iterable[Any]:
        kept = {"mesh": "0.1", "accuracy": "face depth", "adversarial": "face depth"}
        return [cell for cell in QUESTION.cells(asked) if kept.get(cell.part, "") in cell.case]

    files = (f"--csv={written}", f"--picture={picture}", f"--summary={summary}")
    assert ask(replace(QUESTION, cells=few), [*SMALL, *files]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "not measured: overlap, C++: its header is not given; to get it: pip download" in said
    assert "met worst error over every class, of the sphere" in said
    assert "met false zeros of " in said
    with written.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["part"] for row in rows} == {"speed", "accuracy", "adversarial", "tradeoff", "mesh"}
    assert all(float(row["volume"]) <= 1e-15 for row in rows if row["part"] == "accuracy" and row["method"] == "ours")
    methods = {row["method"] for row in rows if row["part"] == "tradeoff"}
    assert {"ours, batch", "29 points", "Monte Carlo 1e3"} <= methods
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert not {"Infinity", "NaN"} & set(summary.read_text().replace(",", "").split())


def test_goals_take_the_worst_class_and_the_ratio_to_the_package() -> None:
    def row(part: str, case: str, method: str = "ours", **figures: Any) -> Row:
        return {"part": part, "solid": "box", "case": case, "grid": False, "method": method, **figures}

    counts: dict[str, Any] = dict.fromkeys(("false_zeros", "undefined", "asymmetry", "shrinking"), 0)
    rows = [
        row("accuracy", "random", volume=2e-16, direction=0.0),
        row("accuracy", "face depth 1e-6", volume=3e-15, direction=0.0, shallow=1e-8),
        row("accuracy", "face depth 1e-9", volume=0.0, direction=0.0, shallow=1.0),
        *(row("adversarial", case, negative=1, pairs=7, **counts) for case in ("random", "far away")),
        *(row("speed", "random", method, ns=ns) for method, ns in ((OURS, 100.0), (KERNEL, 50.0), (HEADER, 1300.0))),
        *(row("mesh", "0.1", triangles=triangles, ns=20.0 * triangles) for triangles in (50.0, 60.0)),
    ]
    found = {goal.claim: (goal.value, goal.verdict) for goal in goals(OverlapSweep(), Table(rows))}
    assert found["worst error over every class, of the sphere"] == (3e-15, "missed")
    assert found["relative error of face, edge and corner overlaps of depth >= 1e-6 R"] == (1e-8, "missed")
    assert found["negative volumes of 14 adversarial pairs"] == (2, "missed")
    assert found["false zeros of 14 adversarial pairs"] == (0, "met")
    assert found["times faster than the C++ package, box, checked, with gradient"] == (13.0, "met")
    assert found["times faster than the C++ package, tetrahedron, checked, with gradient"] == (None, "not measured")
    assert found["mesh query with up to 50 triangles, in boxes"] == (20.0, "met")


def test_approximations_converge_to_the_overlap() -> None:
    # A unit sphere whose lower half is within a large box.
    shape = np.array([[0.0, 0.0, -5.0]]), np.eye(3)[None], np.full((1, 3), 5.0)
    pairs, half = Pairs("box", np.zeros((1, 3)), np.ones(1), shape), 2.0 / 3.0 * math.pi
    assert len(satellite_points()) == 29
    assert np.linalg.norm(satellite_points(), axis=1).max() < 1.0
    # 11 of 29 points are below the plane, and 7 on it, where they count as within.
    assert satellites(pairs)[0] == pytest.approx(2.0 * half * 19.0 / 29.0, rel=1e-12)
    assert monte_carlo(pairs, 10_000)[0] == pytest.approx(half, rel=0.03)
    for solid in ("tetrahedron", "box"):
        _, some = frozen_class(solid, "random", 10)
        exact = kernel_volumes(some) / some.sphere_volumes
        np.testing.assert_allclose(monte_carlo(some, 10_000) / some.sphere_volumes, exact, atol=0.02)


@pytest.mark.processes
@pytest.mark.skipif(
    all(shutil.which(name) is None for name in ("c++", "g++", "clang++")), reason="needs a C++ compiler"
)
def test_the_driver_reads_pairs_and_writes_volumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    header = tmp_path / "overlap.hpp"
    header.write_text(FAKE_HEADER)
    monkeypatch.setattr(published, "_EIGEN", (tmp_path,))
    peer = CompiledHeader(header)
    assert peer.missing == ""
    for solid in ("tetrahedron", "box"):
        _, pairs = frozen_class(solid, "random", 5)
        pairs.radii[2] = 100.0
        corners = package_corners(pairs)
        # In the package's order, right-handed.
        sides = [corners[:, k] - corners[:, 0] for k in ((1, 2, 3) if solid == "tetrahedron" else (1, 3, 4))]
        assert np.all(np.einsum("ni,ni->n", np.cross(sides[0], sides[1]), sides[2]) >= 0.0), solid
        expected = pairs.centers[:, 0] + 10 * pairs.radii + 100 * corners[:, 0, 1] + 1000 * corners[:, -1, 2]
        expected[2] = np.nan
        times_ns, volumes = peer.timed(pairs)
        np.testing.assert_allclose(volumes, expected, rtol=1e-13)
        assert (times_ns >= 0.0).all()
    header.write_text("#error this is not the header")
    assert CompiledHeader(header).missing.startswith("does not compile: ")
