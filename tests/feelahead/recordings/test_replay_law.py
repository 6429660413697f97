"""A recording may be anybody's: what it names is not run."""

import sys
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from common.recording.reading import open_recording
from feelahead import Episode
from feelahead.recordings.replay_robot import replay_robot

LAW = """
import pathlib

pathlib.Path(__file__).with_name("was_run").touch()


class Free:
    def __init__(self, inputs):
        self.inputs = inputs

    def sense(self, situation, now_s):
        return self.inputs.sensed(situation, l2=0.0, r2=0.0)


law = Free
"""


def test_a_law_that_is_a_file_is_not_run_by_a_replay(tmp_path: Path) -> None:
    law, was_run = tmp_path / "free_law.py", tmp_path / "was_run"
    law.write_text(LAW, encoding="utf-8")
    with Episode(scene="wall", law=str(law), sampled=False).record(tmp_path / "run.mcap") as episode:
        episode.arm()
    was_run.unlink()
    sys.modules.pop("feelahead_law_free_law")
    with pytest.raises(ConfigurationError, match=r"with the law .*free_law.py, which replay"):
        replay_robot(open_recording(tmp_path / "run.mcap"))
    assert not was_run.exists()
