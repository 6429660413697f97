"""The truth of a simulation in a recording: what a person hit, how hard, and whether they placed the target."""

import json
from pathlib import Path
from typing import Any

import pytest

from common.recording.reading import open_recording
from feelahead.both_sides.episode import Episode
from feelahead.both_sides.grasping_trial import MISJUDGES_DEPTH
from feelahead.recordings.replay_robot import replay_robot
from operator_side.settings import OperatorSettings


def truths(path: Path) -> list[dict[str, Any]]:
    return [json.loads(message.content) for message in open_recording(path).messages(("/truth",))]


def test_a_pull_without_haptics_hits_the_wall_with_an_impulse(tmp_path: Path) -> None:
    with Episode(scene="wall", haptics=False, seed=0).record(tmp_path / "run.mcap") as episode:
        episode.arm().step(4.0, r2_n=3.0)
    found = truths(tmp_path / "run.mcap")
    contacts = [contact for contact in episode.contacts if contact.thing != "target"]
    last, before = found[-1], next(one for one in found if one["armed"])
    assert contacts
    assert before["hits"] == 0
    assert before["impulse_n_s"] == 0.0
    assert last["hits"] >= 1
    assert last["hit_first"] == contacts[0].thing
    assert last["fastest_hit_mm_s"] == pytest.approx(1e3 * max(one.speed_m_s for one in contacts), abs=1e-6)
    assert last["tool_m"] == pytest.approx(episode.tool_position_m, abs=0.01)
    assert last["obstacle_mm"] < 1.0
    assert not last["placed"]
    # The gripper rests against the wall: what the finger's pull commands presses on and on.
    later = [one["impulse_n_s"] for one in found]
    assert later == sorted(later)
    assert later[-1] > 0.1


def test_the_truth_of_a_whole_grasp_says_that_it_was_placed_and_a_replay_leaves_it_out(tmp_path: Path) -> None:
    given = OperatorSettings(person=MISJUDGES_DEPTH)
    with Episode(scene="wall", seed=3, person="grasping", operator=given).record(tmp_path / "run.mcap") as episode:
        episode.run(seconds=45.0)
    found = truths(tmp_path / "run.mcap")
    task = episode.summary()["task"]
    assert found[-1]["placed"] is task["placing"]["placed"] is True
    assert any(one["held"] == "target" for one in found)
    assert found[-1]["hits"] == 0
    assert found[-1]["impulse_n_s"] == 0.0
    compared = replay_robot(open_recording(tmp_path / "run.mcap"))
    assert compared.equal == compared.made > 100
