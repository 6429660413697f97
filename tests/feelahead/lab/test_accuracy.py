"""`feelahead bench accuracy`: small real cells, whose errors are known, and the rule of the front."""

import csv
import importlib.util
import itertools
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from feelahead.lab.accuracy import distance_peers, onset
from feelahead.lab.accuracy.placements import Placement, as_meshes, placements
from feelahead.lab.accuracy.points import pooled
from feelahead.lab.accuracy.volume import HEADER, without_precise
from feelahead.lab.interleaved import processor_us
from feelahead.lab.questions.accuracy import QUESTION, AccuracySweep, Cell, cells, line, run
from feelahead.lab.reference.approximations import voxels
from feelahead.lab.reference.classes import frozen_class
from feelahead.lab.reference.errors import kernel_volumes
from feelahead.lab.reference.pairs import Pairs
from feelahead.lab.sweep import ask
from feelahead.lab.table import Row, Table

ONE_MORE_MM = 0.02
"""Tolerances of both distances that are compared"""


def made_by_hand(setting: str, us: float, worst: float, part: str = "a", **more: Any) -> Row:
    marks = {"ours": True, "built": False, "reference": "truth", "knob": "k", "cases": 1, "p95": worst / 2.0}
    return {"part": part, "unit": "mm", "setting": setting, "us": us, "worst": worst} | marks | more


def test_a_point_is_off_the_front_if_another_of_its_part_is_both_faster_and_more_accurate() -> None:
    rows = [
        made_by_hand("exact", 9.0, 0.1, built=True),
        made_by_hand("fast", 1.0, 5.0),
        made_by_hand("between", 3.0, 1.0, ours=False),
        made_by_hand("as fast as between", 3.0, 2.0),
        made_by_hand("as exact as between", 4.0, 1.0),
        made_by_hand("beaten by two", 5.0, 7.0),
        made_by_hand("beaten elsewhere", 9.9, 9.9, part="b"),
        made_by_hand("in another unit", 9.9, 9.9, unit="rad"),
        {"missing": "a peer"},
    ]
    found = {row["setting"]: row for row in pooled(Table(rows))}
    assert {name for name, row in found.items() if row["beaten_by"] is not None} == {"beaten by two"}
    assert found["beaten by two"]["beaten_by"] == "fast"
    # A peer is named with what it is.
    rows[1]["us"] = 5.5
    assert {row["setting"]: row["beaten_by"] for row in pooled(Table(rows))}["beaten by two"] == "k, between"
    assert found["fast"]["of_built"] == pytest.approx(1.0 / 9.0)
    assert found["beaten elsewhere"]["of_built"] is None
    assert line(found["exact"])[2] == "exact *"


def test_points_of_several_scenes_are_pooled_by_the_median_time_and_the_largest_errors() -> None:
    rows = [made_by_hand("one", us, worst) for us, worst in ((1.0, 3.0), (9.0, 1.0), (2.0, 8.0))]
    (found,) = pooled(Table(rows))
    assert (found["us"], found["worst"], found["p95"], found["cases"]) == (2.0, 8.0, 4.0, 3)


def test_the_processor_time_of_a_call_is_a_median_of_chunks_in_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """In virtual time: calls take 1 ms or longer; the first round is disturbed, and so is each first call."""
    now_s, called, costs_s = 0.0, [""], {"short": 0.001, "longer": 0.0013, "whole chunk": 0.5}

    def work(name: str) -> None:
        nonlocal now_s
        first, first_round = called[-1] != name, len({*called, name}) < 4 and called.count("whole chunk") == 0
        now_s += costs_s[name] * (2.5 if first and name != "whole chunk" else 1.0) * (1.1 if first_round else 1.0)
        called.append(name)

    monkeypatch.setattr(time, "process_time", lambda: now_s)
    found = processor_us({name: partial(work, name) for name in costs_s}, 3)
    assert found == pytest.approx({"short": 1000.0, "longer": 1300.0, "whole chunk": 500_000.0})
    turns = [name for name, _ in itertools.groupby(called[1:])]
    assert turns == 3 * list(costs_s)


@pytest.fixture(scope="module")
def before_ball() -> Sequence[Placement]:
    return placements("ball", 2, np.random.default_rng(3))


def test_finer_covers_touch_later_and_a_look_is_never_late(before_ball: Sequence[Placement]) -> None:
    axis, truths_m = before_ball[0].axis, np.array([there.true_m for there in before_ball])
    by_cover = {}
    for one in onset.settings(before_ball):
        early_mm = 1e3 * (truths_m - one.contacts_m(axis))
        full_mm = 1e3 * (truths_m - np.array([look() for look in one.onsets(onset.Looks(before_ball[0]), axis)]))
        if one.knob == "cover's stand-out":
            by_cover[int(one.name.split(" ")[0])] = early_mm
            assert early_mm.max() <= int(one.name.split(" ")[0]) + ONE_MORE_MM
        # Full strength begins where the spheres touch, or sooner: within the margin of 12 mm.
        assert (early_mm > -ONE_MORE_MM).all()
        assert (full_mm > early_mm - ONE_MORE_MM).all()
        assert (full_mm < early_mm + 12.0).all()
    assert list(by_cover) == list(onset.COVERS_MM)
    assert by_cover[1].max() < by_cover[3].max() < by_cover[10].max()


def test_placements_are_ahead_and_the_objects_as_meshes_are_the_same(before_ball: Sequence[Placement]) -> None:
    assert len(before_ball) == 2
    for there in before_ball:
        assert 0.01 < there.true_m < 0.15 + 1e-4
        assert len(as_meshes(there.seen).mesh_index) == 1
        assert as_meshes(there.seen, balls=False) is there.seen
    (wall,) = placements("wall", 1, np.random.default_rng(3))
    box, mesh = (onset.first_touch_m(wall.pose, seen, wall.axis) for seen in (wall.seen, as_meshes(wall.seen)))
    assert len(as_meshes(wall.seen).box_object) == 0
    assert mesh == pytest.approx(box, abs=2e-4)


def test_peers_find_the_distance_along_the_approach(before_ball: Sequence[Placement]) -> None:
    there, found = before_ball[0], distance_peers.peers(before_ball)
    spheres_m = onset.first_touch_m(there.pose, there.seen, there.axis)
    for (peer, setting), method in found.items():
        if peer == "distance grid":
            assert method(there) == pytest.approx(spheres_m, abs=3e-3), setting
        elif setting == "along û":
            assert method(there) == pytest.approx(there.true_m, abs=3e-5), peer
        else:
            # The nearest distance is in no direction: it is at most that along û, and less beside the ball.
            assert method(there) < there.true_m + 3e-5, peer
    assert {peer for peer, _ in found} >= {"MuJoCo", "distance grid"}


def test_a_grid_of_the_wall_is_exact(before_ball: Sequence[Placement]) -> None:
    del before_ball
    walls = placements("wall", 2, np.random.default_rng(5))
    grid = distance_peers.DistanceGrid(walls, 0.01)
    for there in walls:
        touch_m = onset.first_touch_m(there.pose, there.seen, there.axis)
        assert grid.along_m(there) == pytest.approx(touch_m, abs=3e-4)


def test_older_looks_are_corrected_for_the_motion_along_the_approach(before_ball: Sequence[Placement]) -> None:
    now, later = (onset.older(before_ball, age_s) for age_s in (0.0, 0.04))
    # Uncorrected, 40 ms at 0.24 m/s would be 9.6 mm later.
    assert (np.abs(later - now) < 4e-3).all()
    assert (np.abs(later - now) > 0.0).any()


def test_more_places_miss_less_of_a_curved_path(before_ball: Sequence[Placement]) -> None:
    looks, motions = onset.Looks(before_ball[0]), list(itertools.product(before_ball, range(4)))
    off_m = {
        n: [onset.curved(looks, there, k, n) - onset.curved(looks, there, k, 32) for there, k in motions]
        for n in (0, 2, 8)
    }
    # Every place of 2 and 8 is one of 32, so fewer places find the object later, never sooner.
    assert all(one >= -1e-9 for errors in off_m.values() for one in errors)
    assert sum(off_m[0]) > sum(off_m[2]) >= sum(off_m[8])


def test_without_precise_forms_shallow_overlaps_lose_digits() -> None:
    for solid in ("box", "tetrahedron"):
        _, pairs = frozen_class(solid, "edge depth 1e-3", 6)
        with_forms, without = kernel_volumes(pairs), without_precise(pairs)
        relative = np.abs(without - with_forms) / with_forms
        assert 1e-12 < relative.max() < 1e-5
        _, pairs = frozen_class(solid, "random", 6)
        np.testing.assert_allclose(without_precise(pairs), kernel_volumes(pairs), rtol=1e-12)


def test_finer_voxels_come_nearer_to_the_overlap() -> None:
    _, pairs = frozen_class("box", "random", 8)
    exact = kernel_volumes(pairs)
    coarse, fine = (np.abs(voxels(pairs, edge) - exact) / pairs.sphere_volumes for edge in (0.5, 0.1))
    assert fine.max() < 0.02
    assert fine.max() < coarse.max() < 0.3
    # Halves of a ball, below and above its middle, have equally many voxels.
    halves = np.array([[0.0, 0.0, -5.0], [0.0, 0.0, 5.0]]), np.broadcast_to(np.eye(3), (2, 3, 3)), np.full((2, 3), 5.0)
    below, above = voxels(Pairs("box", np.zeros((2, 3)), np.ones(2), halves), 0.25)
    assert below == pytest.approx(above)


def test_cells_of_volume_pose_and_delta_have_the_errors_that_their_docs_say() -> None:
    rows = [
        row
        for cell in (Cell("volume", "shallow edge", "box", 3, 1), Cell("pose", "wall", "", 3, 1, 0.6))
        for row in run(cell, 0)
    ]
    (missing,) = Table(rows).values("missing")
    assert missing.startswith(f"{HEADER}: its header is not given")
    found = {(row["part"], row["unit"], row["setting"]): row for row in pooled(Table(rows))}
    shallow = "volume, shallow edge", "of the overlap"
    assert found[*shallow, "on"]["worst"] < 1e-13 < found[*shallow, "off"]["worst"] < 1e-5
    assert found[*shallow, "1e4 points"]["worst"] == 1.0
    assert found["volume, shallow edge", "of the sphere", "off"]["worst"] < 1e-14
    assert found["pose, exact readings", "mm of pose", "spheres and Jacobian"]["worst"] < 1e-9
    noisy = {setting: row["p95"] for (part, _, setting), row in found.items() if part.startswith("pose, noise")}
    assert noisy["turns of 1ms"] < noisy["turns of 4ms"] < noisy["turns of 10ms"] < noisy["none"]
    assert 0.05 < noisy["none"] < 2.0


@pytest.mark.long
def test_the_command_prints_one_table_and_draws_its_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written, picture = tmp_path / "out.csv", tmp_path / "out.png"
    few = [
        Cell("looks", "ball", "", 2, 1),
        Cell("paths", "ball", "", 2, 1),
        Cell("volume", "random", "box", 2, 1),
        Cell("delta", "200", "", 1, 1, 1.0),
        Cell("turns", "0", "", 1, 1, 2.0),
    ]
    asked = [f"--csv={written}", f"--picture={picture}"]
    assert ask(replace(QUESTION, cells=lambda _: few), asked) == 0
    assert "not measured: overlap, C++: its header is not given; to get it: pip download" in capsys.readouterr().out
    with written.open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if not row.get("missing")]
    assert all(float(row["us"]) > 0.0 for row in rows)
    delta = {row["setting"]: float(row["worst"]) for row in rows if row["part"].startswith("δ")}
    assert delta["operator's"] < delta["robot's, v t_d"]
    (slow,) = [row for row in rows if row["setting"].startswith("1ms, at ")]
    assert float(slow["worst"]) == 0.0
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_the_grid_has_all_classes_scenes_and_knobs() -> None:
    asked = list(cells(AccuracySweep()))
    assert {cell.what for cell in asked} == {"looks", "paths", "volume", "pose", "delta", "turns"}
    assert {cell.case for cell in asked if cell.what == "looks"} == {"wall", "ball", "post", "cluttered", "mug"}
    assert {cell.case for cell in asked if cell.what == "volume"} >= {"tangent", "shallow edge", "R/L 100"}
    assert len(list(cells(AccuracySweep(quick=True)))) < len(asked)


def test_without_coal_a_line_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, before_ball: Sequence[Placement]
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    assert "pip install coal" in distance_peers.coal_missing()
    assert not any(peer == "coal" for peer, _ in distance_peers.peers(before_ball))
