"""Flow of participants from a folder of a study."""

from pathlib import Path

from feelahead.study.events import Begun, Enrolled, Withdrew
from feelahead.study.folder import TRIALS, Study
from feelahead.study.report.reading import read_tables
from feelahead.study.report.summaries import flow
from tests.feelahead.study.driving import do_all, do_step
from tests.helpers.repository import ROOT

TEXT = """
name = "Small"
participants = 2
seed = 7
controller = "keyboard"
scenes = ["wall"]
delays_ms = [0.0]
trials = 1
practice = {scene = "wall", condition = "felt", successes = 1, most = 1}
[conditions.off]
haptics = false
[conditions.felt]
"""


def test_a_recording_that_cannot_be_read_is_excluded_with_its_reason(tmp_path: Path) -> None:
    file, folder = tmp_path / "study.toml", tmp_path / "study"
    file.write_text(TEXT)
    with Study(folder, file) as study:
        do_all(study, 1)
    (folder / TRIALS / "p01-t001.mcap").unlink()
    tables = read_tables(folder)
    trials = tables.trials[~tables.trials.practice]
    assert (trials.status == "complete").all()
    assert trials.excluded.iloc[0] == "p01-t001.mcap: cannot be read: No such file or directory"
    assert trials.excluded.iloc[1].startswith("p01-t002.mcap: ")
    assert (tables.trials.excluded[tables.trials.practice] == "practice").all()
    assert len(tables.analysed) == 0


def test_who_was_enrolled_is_counted_also_without_a_trial(tmp_path: Path) -> None:
    with Study(tmp_path / "study", ROOT / "examples" / "study.toml") as study:
        for number in (1, 2, 4):
            study.add(Enrolled(participant=number, at_s=0.0))
        study.add(Withdrew(participant=2, at_s=1.0))
        do_step(study, 1)
        study.add(Begun(participant=1, at_s=2.0, trial=1, attempt=1, practice=True))
    tables = read_tables(tmp_path / "study")
    assert (tables.enrolled, tables.withdrew) == ((1, 2, 4), (2,))
    counts = dict(flow(tables, ()))
    assert counts["participants who were enrolled"] == 3
    assert counts["of these without a trial in the data"] == 2
