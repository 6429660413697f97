"""`feelahead try field` from its flags to its table, summary and picture, and how far before things strengths begin."""

import json
import math
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import feelahead.main
from common.errors import ConfigurationError
from feelahead.experiments.field import command as module
from feelahead.experiments.field.command import try_field
from feelahead.experiments.field.looking import Look, Looker
from feelahead.lab.approaches.frozen import frozen_hash
from tests.helpers.repository import DATA

WALL = str(DATA / "wall.xml")
FEW = ("--looks", "2", "--step-mm", "50")
COVER_MM, RAMP_MM = 3.0, 12.0


def looked(tmp_path: Path, *arguments: str) -> dict[str, Any]:
    path = tmp_path / "summary.json"
    assert try_field([*FEW, "--summary", str(path), *arguments]) == 0

    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    summary: dict[str, Any] = json.loads(path.read_text(), parse_constant=refuse)
    return summary


def test_a_scene_is_a_row_a_list_and_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "picture.png"
    arguments = ["try", "field", *FEW, "--model", WALL, "--picture", str(picture)]
    assert feelahead.main.command(arguments) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "80 mm before each thing: ways in mm after which R2 begins to resist" in said
    assert "│ wall │" in said
    assert f"frozen scenes and limits: {frozen_hash()}" in said
    assert picture.read_bytes().startswith(b"\x89PNG")
    summary = looked(tmp_path, "--model", WALL)
    assert summary["frozen"] == frozen_hash()
    assert [look["free_mm"] for look in summary["scenes"]["wall"]] == pytest.approx([0.0, 50.0, 80.0, 100.0, 150.0])
    for look in summary["scenes"]["wall"]:
        assert look.keys() == {"free_mm", "ways_mm", "sigma_mm", "overlaps", "r2_us", "l2_us"}
        assert look["overlaps"] > 0
        assert min(look["r2_us"], look["l2_us"]) > 0.0


def test_strengths_begin_as_far_before_each_thing_however_far_it_is(tmp_path: Path) -> None:
    scenes = looked(tmp_path, "--model", WALL, str(DATA / "rod_5mm.xml"))["scenes"]
    assert scenes.keys() == {"wall", "rod_5mm"}
    for looks in scenes.values():
        far = [look for look in looks if look["free_mm"] >= 50.0]
        before_mm = np.array([np.subtract(look["free_mm"], look["ways_mm"]) for look in far])
        np.testing.assert_allclose(before_mm, np.broadcast_to(before_mm[0], before_mm.shape), atol=1e-6)
        assert (np.diff(before_mm, axis=1) <= 0.0).all()
        # The eighth at D_σ and what the spheres stand out, or a little earlier, as strengths are rounded; the first on
        # the ramp before.
        begins_mm = before_mm[0] - far[0]["sigma_mm"]
        assert 0.0 < begins_mm[7] < COVER_MM + 0.25 * RAMP_MM
        assert begins_mm[7] < begins_mm[0] < COVER_MM + RAMP_MM


def test_the_probability_moves_where_they_begin(tmp_path: Path) -> None:
    usual, even = (looked(tmp_path, "--model", WALL, *p)["scenes"]["wall"] for p in ((), ("--probability", "0.5")))
    assert {look["sigma_mm"] for look in even} == {0.0}
    for careful, bold in zip(usual[1:], even[1:], strict=True):
        nearer_mm = np.subtract(bold["ways_mm"], careful["ways_mm"])
        # The ramp of spheres that are not inflated is another one, by less than a strength.
        np.testing.assert_allclose(nearer_mm, careful["sigma_mm"], atol=RAMP_MM / 8.0)


def test_a_look_is_timed_by_the_clock_that_is_given() -> None:
    ticks = iter(range(1000))
    look = Looker(DATA / "wall.xml", "tool", 0.99).look(0.08, 5, lambda: 1e-6 * next(ticks))
    # From one call to the next it goes on by a microsecond.
    assert (look.r2_us, look.l2_us) == pytest.approx((1.0, 1.0))
    assert next(ticks) == 5 * 2 * 2


def test_two_scenes_of_one_name_are_two_rows(tmp_path: Path) -> None:
    paths = [tmp_path / folder / "wall.xml" for folder in ("one", "other")]
    for path in paths:
        path.parent.mkdir()
        path.write_text((DATA / "wall.xml").read_text())
        (path.parent / "arm.xml").write_text((DATA / "arm.xml").read_text())
    found = looked(tmp_path, "--model", *(str(path) for path in paths))
    assert list(found["scenes"]) == [str(path) for path in paths]
    one, other = ([look["ways_mm"] for look in looks] for looks in found["scenes"].values())
    assert one == other
    assert found["frozen"] == frozen_hash(paths) != frozen_hash()


class NoStrength:
    """Looks at a thing that never gives any."""

    def __init__(self, *_: object) -> None:
        pass

    def look(self, free_m: float, *_: object) -> Look:
        return Look(1e3 * free_m, (math.inf,) * 8, 7.0, 0, 1.0, 1.0)


def test_what_never_begins_is_null(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "Looker", NoStrength)
    looks = looked(tmp_path, "--model", WALL, "--picture", str(tmp_path / "picture.png"))["scenes"]["wall"]
    assert [look["ways_mm"] for look in looks] == [[None] * 8] * 5
    assert looks[2] == asdict(NoStrength().look(0.08)) | {"ways_mm": [None] * 8}


# Bad input


@pytest.fixture
def no_looks(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Whatever is wrong is said before anything is looked at."""
    asked: list[object] = []
    monkeypatch.setattr(module, "Looker", lambda *arguments: asked.append(arguments))
    yield
    assert asked == []


@pytest.mark.usefixtures("no_looks")
@pytest.mark.parametrize(
    ("arguments", "named", "valid"),
    [
        (["--probability", "1"], "--probability 1.0", "above 0 and below 1"),
        (["--probability", "nan"], "nan", "above 0 and below 1"),
        (["--step-mm", "0"], "--step-mm 0", "1 to 150"),
        (["--step-mm", "nan"], "nan", "1 to 150"),
        (["--step-mm", "151"], "151", "1 to 150"),
        (["--looks", "0"], "--looks 0", "1 to 100000"),
        (["--looks", "2.5"], "2.5", "a whole number"),
        (["--model", WALL, "no_such.xml"], "no_such.xml: there is no such file", "MJCF"),
        (["--model", WALL, str(DATA)], f"--model {DATA}: is a directory", "MJCF"),
        (["--summary", "no/such/folder/out.json"], "no/such/folder", "a file's path"),
        (["--picture", "out.xyz"], "out.xyz", "png"),
        (["--look", "3"], "--look", "--help"),
    ],
)
def test_one_line_names_the_value_and_what_is_valid(arguments: list[str], named: str, valid: str) -> None:
    with pytest.raises(ConfigurationError) as caught:
        try_field(arguments)
    text = str(caught.value)
    assert "\n" not in text
    assert named in text
    assert valid in text


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--model", WALL, "--site", "hand"], "'hand'; valid: tool"),
        (["--model", str(DATA / "empty.xml")], "nothing is ahead of the gripper within 2 m; valid: a scene with"),
    ],
)
def test_a_scene_that_does_not_serve_is_named(arguments: list[str], named: str) -> None:
    with pytest.raises(ConfigurationError, match=named):
        try_field([*FEW, *arguments])
