"""`feelahead bench overlap`, run at a small size through the command, and what it compares with."""

import csv
import importlib.util
import math
import shutil
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from rich.progress import Progress

import feelahead.main
from common.arrays import FloatArray
from common.clock import MonotonicClock, VirtualClock
from common.errors import ConfigurationError
from feelahead.benchmarks.overlap import peers as overlap_peers
from feelahead.benchmarks.overlap.accuracy import draw_samples, measure_accuracy
from feelahead.benchmarks.overlap.approximations import monte_carlo, quadrature, satellite_points, satellites, voxels
from feelahead.benchmarks.overlap.classes import MAKERS, frozen_classes
from feelahead.benchmarks.overlap.goals import judge
from feelahead.benchmarks.overlap.ours import kernel_volumes
from feelahead.benchmarks.overlap.pairs import Pairs, Solid
from feelahead.benchmarks.overlap.peers import HeaderPeer, PythonPeer, package_corners
from feelahead.benchmarks.overlap.stress import count_failures
from feelahead.benchmarks.overlap.times.call_sizes import measure_call_sizes
from feelahead.benchmarks.overlap.times.speed import BATCH, TRIVIAL, partial_pairs, trivial_pairs
from feelahead.benchmarks.overlap.times.timing import Contender, in_turns, short_calls
from feelahead.benchmarks.overlap.times.widths import wide_vectors_pay
from feelahead.benchmarks.overlap.tiny import measure_tiny
from feelahead.benchmarks.report import COLUMNS, Goal, Report, short

SMALL = ("--quick", "--adversarial", "196", "--truths", "2", "--timed", "100")

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
    written, figures, docs = tmp_path / "out.csv", tmp_path / "figures", tmp_path / "benchmarks.md"
    arguments = ["bench", "overlap", *SMALL, f"--csv={written}", f"--figures={figures}", f"--write-docs={docs}"]
    assert feelahead.main.command(arguments) == 0

    shown = " ".join(capsys.readouterr().out.split())
    assert "overlap in C++: no header: pip download" in shown
    assert "false zeros" in shown
    assert "NaN or infinity let pass: 0, at most 0 asked" in shown
    with written.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    sections = {row["section"] for row in rows}
    assert sections >= {"speed", "accuracy", "tiny", "directions", "stress", "tradeoff"}
    assert all(math.isfinite(float(row["value"])) for row in rows if row["method"].startswith("ours"))
    methods = {row["method"] for row in rows if row["section"] == "tradeoff"}
    assert {"ours, a call each", "ours, batch", "29 satellite points", "Monte Carlo 1e3", "voxels 8³"} <= methods
    pictures = sorted(path.name for path in figures.iterdir())
    assert pictures == ["overlap_mesh_cost.png", "overlap_time_error.png"]
    assert all((figures / name).read_bytes().startswith(b"\x89PNG") for name in pictures)
    text = docs.read_text(encoding="utf-8")
    assert "## Machine" in text
    assert "## Goals" in text
    assert all(f"(benchmarks/{name})" in text and (tmp_path / "benchmarks" / name).is_file() for name in pictures)


@pytest.mark.parametrize(
    ("arguments", "named", "valid"),
    [
        (["bench", "overlp"], "overlp", "overlap"),
        (["bench", "overlap", "--truths", "1"], "--truths 1", "2 to"),
        (["bench", "overlap", "--truths", "many"], "many", "number"),
        (["bench", "overlap", "--timed", "0"], "--timed 0", "10 to"),
        (["bench", "overlap", "--adversarial", "-5"], "--adversarial -5", "1 to"),
        (["bench", "overlap", "--seed", "-1"], "--seed -1", "0 or more"),
        (["bench", "overlap", "--csv", "/nowhere/at/all.csv"], "/nowhere/at/all.csv", "its folder is not there"),
        (["bench", "overlap", "--write-docs", "/"], "--write-docs /", "a file"),
        (["bench", "overlap", "--peer-header", "/nowhere/overlap.hpp"], "/nowhere/overlap.hpp", "pip download"),
        (["bench", "overlap", "--figures", __file__], "--figures", "a folder"),
        (["bench", "overlap", "--fast"], "--fast", "--help"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], named: str, valid: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        feelahead.main.command(arguments)
    assert "\n" not in str(caught.value)
    assert named in str(caught.value)
    assert valid in str(caught.value)


def test_a_missing_package_is_named_with_what_brings_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.startswith("feelahead.benchmarks.overlap")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mpmath", None)
    with pytest.raises(ConfigurationError, match=r"mpmath.*pip install 'feelahead\[robot,bench\]'"):
        feelahead.main.command(["bench", "overlap"])


def test_everything_else_runs_without_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    peer, report, progress = PythonPeer(), Report(), Progress(console=Console(quiet=True))
    assert peer.missing == "not installed: pip install 'feelahead[bench]'"
    classes = {name: pairs for name, pairs in frozen_classes(2).items() if "depth" in name or "random" in name}
    samples = draw_samples(classes, progress)
    measure_accuracy(report, samples, peer)
    measure_tiny(report, samples, peer)
    ours, theirs = count_failures(report, classes, samples, peer, progress)
    assert ours.pairs == 2 * len(classes)
    assert theirs is None
    judge(report, "a processor")
    assert {figure.method for figure in report.figures} == {"ours"}
    verdicts = {goal.claim: goal.verdict for goal in report.goals}
    assert verdicts["exceptions"] == "met"
    assert verdicts["times faster than the C++ package, box, checked, with gradient"] == "not measured"


def test_help_lists_the_benchmarks_and_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    assert feelahead.main.command(["bench", "--help"]) == 0
    assert "overlap" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        feelahead.main.command(["bench", "overlap", "--help"])
    shown = capsys.readouterr().out
    assert "--peer-header" in shown
    assert "pip download" in shown


def test_the_classes_are_frozen() -> None:
    first, again, other = frozen_classes(3), frozen_classes(3), frozen_classes(3, seed=1)
    assert len(first) == 2 * sum(len(makers) for makers in MAKERS.values())
    for name, pairs in first.items():
        assert len(pairs) == 3
        for array, same in zip(pairs.arguments, again[name].arguments, strict=True):
            assert np.array_equal(array, same), name
    changed = [name for name in first if not np.array_equal(first[name].centers, other[name].centers)]
    assert len(changed) == len(first)


def test_grid_classes_are_short_binary_numbers() -> None:
    for name in ("tetrahedron, tangent vertex, grid", "box, tangent edge, grid", "box, centre on face, grid"):
        for array in frozen_classes(50)[name].arguments:
            assert np.array_equal(array * 32.0, np.round(array * 32.0)), name


@pytest.mark.parametrize("solid", ["tetrahedron", "box"])
def test_speed_pairs_are_what_they_are_called(solid: Solid) -> None:
    pairs = partial_pairs(solid, 50)
    volumes = kernel_volumes(pairs)
    assert len(pairs) == 50
    assert np.all((volumes > 0.0) & (volumes < np.minimum(pairs.sphere_volumes, pairs.solid_volumes)))
    for name in TRIVIAL:
        trivial = trivial_pairs(solid, name, 20)
        expected = {
            "apart": np.zeros(20),
            "solid within sphere": trivial.solid_volumes,
            "sphere within solid": trivial.sphere_volumes,
        }[name]
        np.testing.assert_allclose(kernel_volumes(trivial), expected, rtol=1e-12)


def half_covered() -> Pairs:
    """A unit sphere whose lower half lies within a large box."""
    return Pairs(
        "box",
        np.zeros((1, 3)),
        np.ones(1),
        (np.array([[0.0, 0.0, -5.0]]), np.eye(3)[None], np.full((1, 3), 5.0)),
    )


def test_approximations_converge_to_the_overlap() -> None:
    pairs = half_covered()
    half = 2.0 / 3.0 * math.pi
    assert len(satellite_points()) == 29
    assert np.linalg.norm(satellite_points(), axis=1).max() < 1.0
    # 11 of 29 points lie below the plane, and 7 on it, where they count as within.
    assert satellites(pairs)[0] == pytest.approx(2.0 * half * 19.0 / 29.0, rel=1e-12)
    assert monte_carlo(pairs, 10_000)[0] == pytest.approx(half, rel=0.03)
    assert voxels(pairs, 32)[0] == pytest.approx(half, rel=0.01)
    assert quadrature(pairs, 1e-6)[0] == pytest.approx(half, rel=1e-5)


def test_approximations_agree_on_random_solids() -> None:
    for solid in ("tetrahedron", "box"):
        pairs = frozen_classes(10)[f"{solid}, random, general"]
        exact = kernel_volumes(pairs) / pairs.sphere_volumes
        np.testing.assert_allclose(voxels(pairs, 32) / pairs.sphere_volumes, exact, atol=0.02)
        np.testing.assert_allclose(monte_carlo(pairs, 10_000) / pairs.sphere_volumes, exact, atol=0.02)


def test_corners_for_the_package_are_in_its_order() -> None:
    for name in ("box, random, general", "box, random, grid", "tetrahedron, random, general"):
        corners = package_corners(frozen_classes(20)[name])
        fourth = 3 if corners.shape[1] == 4 else 4
        sides = [corners[:, k] - corners[:, 0] for k in (1, 2 if fourth == 3 else 3, fourth)]
        assert np.all(np.einsum("ni,ni->n", np.cross(sides[0], sides[1]), sides[2]) >= 0.0), name


@pytest.mark.processes
@pytest.mark.skipif(
    all(shutil.which(name) is None for name in ("c++", "g++", "clang++")), reason="needs a C++ compiler"
)
def test_the_driver_reads_pairs_and_writes_volumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    header = tmp_path / "overlap.hpp"
    header.write_text(FAKE_HEADER)
    monkeypatch.setattr(overlap_peers, "_EIGEN", (tmp_path,))
    peer = HeaderPeer(header)
    try:
        assert peer.missing == ""
        for name in ("tetrahedron, random, general", "box, random, general"):
            pairs = frozen_classes(5)[name]
            pairs.radii[2] = 100.0
            corners = package_corners(pairs)
            expected = pairs.centers[:, 0] + 10 * pairs.radii + 100 * corners[:, 0, 1] + 1000 * corners[:, -1, 2]
            expected[2] = np.nan
            timing = peer.timing(pairs, 3)
            np.testing.assert_allclose(timing.volumes, expected, rtol=1e-13)
            assert timing.overlap_ns >= 0.0
        header.write_text("#error this is not the header")
        assert HeaderPeer(header).missing.startswith("does not compile: ")
    finally:
        peer.close()


def test_what_takes_turns_counts_by_the_least_time_of_each_part() -> None:
    clock = VirtualClock()
    given = {"first": [[40.0, 20.0], [30.0, 90.0]], "second": [[7.0], [9.0]]}
    order: list[str] = []

    def turn(name: str) -> FloatArray:
        order.append(name)
        return np.array(given[name][order.count(name) - 1])

    contenders = [Contender(name, 10, partial(turn, name)) for name in given]
    assert in_turns(contenders, 2) == {"first": 5.0, "second": 0.7}
    assert order == ["first", "second", "first", "second"]

    # Calls that take 3 ms, then 1 ms each, of which there are enough to fill a turn.
    taken: list[float] = []

    def run() -> None:
        taken.append(0.001 if taken else 0.003)
        clock.advance_to(clock.now() + taken[-1])

    assert short_calls("calls", [run, run], 2, clock).turn() == pytest.approx([1e6, 1e6])
    assert 0.03 <= sum(taken) <= 0.033


def test_calls_of_every_size_are_timed() -> None:
    report = Report()
    with Progress(disable=True) as progress:
        measure_call_sizes(report, progress, 64, 1, MonotonicClock())
    assert [row[0] for row in report.tables[0].rows] == ["1", "8", "64"]
    assert (report.value("calls", "ours, checked", "box", "8 pairs", "time") or 0.0) > 0.0


@pytest.mark.parametrize(("wide", "pays"), [(94.0, True), (96.0, False), (None, False)])
def test_wide_vectors_pay_where_they_are_measured_to(wide: float | None, pays: bool) -> None:
    report = Report()
    for solid in ("tetrahedron", "box"):
        for bits, each_ns in ((256, 100.0), (512, wide)):
            if each_ns is not None:
                case = f"{BATCH} pairs a call"
                report.add("widths", f"{bits} bits", solid, case, {"time": (each_ns, "ns/pair")})
    assert wide_vectors_pay(report) is pays
    report.add("speed", "ours, checked", "box", "partial", {"time": (100.0, "ns/pair")})
    report.add("speed", "overlap, C++", "box", "partial", {"time": (1500.0, "ns/pair")})
    judge(report, "a processor")
    goal = next(goal for goal in report.goals if "C++ package, box" in goal.claim)
    assert goal.detail == "1500 / 100 ns a pair; a processor"
    assert goal.verdict == ("missed" if pays else "met")


def test_goals_are_judged_both_ways() -> None:
    assert Goal("", 1.0, 1.0).verdict == "met"
    assert Goal("", 1.1, 1.0).verdict == "missed"
    assert Goal("", 9.9, 10.0, "at least").verdict == "missed"
    assert Goal("", 10.0, 10.0, "at least").verdict == "met"
    assert Goal("", None, 1.0).verdict == "not measured"
    assert Goal("", math.nan, 1.0).verdict == "not measured"


def test_a_report_finds_its_figures() -> None:
    report = Report()
    report.add("speed", "ours", "box", "partial", {"time": (12.5, "ns/pair")})
    assert report.value("speed", "ours", "box", "partial", "time") == 12.5
    assert report.value("speed", "theirs", "box", "partial", "time") is None


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (3.0, "3"), (0.1234, "0.123"), (1234.5, "1234"), (1.234e-16, "1.2e-16"), (math.inf, "inf")],
)
def test_figures_are_short(value: float, text: str) -> None:
    assert short(value) == text
