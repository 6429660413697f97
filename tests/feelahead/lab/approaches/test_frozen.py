"""The frozen inputs do not change, as figures that were measured at different times are compared."""

from pathlib import Path

import pytest

from common.errors import ConfigurationError
from feelahead.lab.approaches import frozen
from feelahead.lab.approaches.frozen import AHEAD, ASIDE, PASSED, SITE, frozen_hash, frozen_scene
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.enlargement.prediction_errors import BUILT_IN, load_prediction_errors
from tests.helpers.repository import DATA

HASH = "1ca4b26f5fb3"
WHAT_A_CHANGE_MEANS = (
    "a frozen scene, force or limit is another one: no figure measured with the former hash may be compared with one"
    " measured from now on. Take the change back, or give it its own scene; if it must be, measure everything anew"
)


def test_the_hash_is_the_one_that_figures_were_measured_with() -> None:
    assert frozen_hash() == HASH, WHAT_A_CHANGE_MEANS


def test_every_scene_has_the_arm_whose_predictions_were_measured() -> None:
    arms = {load_scene(frozen_scene(name), SITE).robot.fingerprint for name in (*AHEAD, *ASIDE, *PASSED)}
    assert arms == {load_scene().robot.fingerprint} == {load_prediction_errors(BUILT_IN).arm}


def test_an_unknown_scene_is_named_with_the_known_ones_or_with_where_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ConfigurationError, match=r"'wal'.*valid: wall, plate, .*empty"):
        frozen_scene("wal")
    monkeypatch.setattr(frozen, "SCENES", tmp_path / "data")
    with pytest.raises(ConfigurationError, match="a clone of the repository"):
        frozen_scene("wall")


def test_the_hash_covers_a_model_of_somebody_elses(tmp_path: Path) -> None:
    assert frozen_hash([DATA / "wall.xml"]) == HASH
    mine = tmp_path / "wall.xml"
    mine.write_text("<mujoco/>")
    first = frozen_hash([mine])
    assert first != HASH
    assert frozen_hash([DATA / "plate.xml", mine]) == first
    mine.write_text("<mujoco />")
    assert frozen_hash([mine]) not in (HASH, first)
