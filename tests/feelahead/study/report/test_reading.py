"""Tables of a study from recordings of which none can be read."""

from pathlib import Path

from feelahead.study.folder import TRIALS, Study
from feelahead.study.report.reading import read_tables
from tests.feelahead.study.driving import do_all

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
