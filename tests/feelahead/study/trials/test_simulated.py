"""A whole study with simulated participants: the same figures with one and two workers, and after an interruption."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from pathlib import Path

import pandas
import pytest

from feelahead.study.events import Begun
from feelahead.study.folder import Study
from feelahead.study.report.reading import read_tables
from feelahead.study.trials import participants, simulated
from feelahead.study.trials.simulated import run_simulated
from operator_side.settings import OperatorSettings
from robot_side.settings import RobotSettings

PROTOCOL = """
name = "Small"
participants = 2
seed = 5
controller = "keyboard"
scenes = ["wall"]
delays_ms = [0.0]
trials = 1
limit_s = 4.0
items = [{text = "I felt safe."}]
[conditions.off]
haptics = false
[conditions.margin]
law = "margin"
margin_m = 0.03
"""


def run(folder: Path, protocol: Path, workers: int) -> tuple[pandas.DataFrame, pandas.DataFrame]:
    with Study(folder, protocol) as study:
        run_simulated(study, 2, workers)
    tables = read_tables(folder)
    assert tables.simulated
    return tables.trials, tables.answers


def test_simulated_persons_err_otherwise_under_each_condition(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    began: list[tuple[RobotSettings, OperatorSettings]] = []

    class Nothing(AbstractContextManager["Nothing"]):
        """An episode that is over at once."""

        time_s, done = 1.0, True

        def __init__(self, robot: RobotSettings, operator: OperatorSettings, **_: object) -> None:
            began.append((robot, operator))

        def __exit__(self, *_: object) -> None:
            pass

        def record(self, recording: Path) -> None:
            recording.write_text("")

    monkeypatch.setattr(simulated, "Episode", Nothing)
    monkeypatch.setattr(simulated, "processes", ThreadPoolExecutor)
    monkeypatch.setattr(simulated, "outcome_of", lambda *_: None)
    monkeypatch.setattr(participants, "_MOST_LAPSES", 1.0)
    protocol = tmp_path / "small.toml"
    protocol.write_text(PROTOCOL.replace("trials = 1", "trials = 20"))
    with Study(tmp_path / "study", protocol) as study:
        run_simulated(study, 1, 1)
    off = {robot.seed: operator for robot, operator in began if not operator.haptics}
    felt = {robot.seed: operator for robot, operator in began if operator.haptics}
    assert len(off) == 20
    assert off.keys() == felt.keys()
    assert not {one.seed for one in off.values()} & {one.seed for one in felt.values()}
    lapses = [((off[seed].person.trust == 0.0), (felt[seed].person.trust == 0.0)) for seed in off]
    assert {(True, False), (False, True)} <= set(lapses)


@pytest.mark.long
def test_a_whole_study_gives_the_same_tables_whatever_interrupts_it(tmp_path: Path) -> None:
    protocol = tmp_path / "small.toml"
    protocol.write_text(PROTOCOL)
    trials, answers = run(tmp_path / "two", protocol, 2)
    assert len(trials) == 4
    assert set(trials["condition"]) == {"off", "margin"}
    assert (trials["status"] == "complete").all()
    assert trials["path_m"].min() > 0.01
    assert len(answers) == 2 * 2 * 7
    # A run that was killed in a trial: it is begun again, and the attempt is in the table as a fault.
    with Study(tmp_path / "killed", protocol) as study:
        run_simulated(study, 1, 1)
        first = next(one for one in study.journal.events if isinstance(one, Begun))
        lines = (tmp_path / "killed" / "journal.jsonl").read_bytes().splitlines(keepends=True)
    cut = next(place for place, line in enumerate(lines) if b'"begun"' in line) + 1
    (tmp_path / "killed" / "journal.jsonl").write_bytes(b"".join(lines[:cut]) + b'{"event": "en')
    for recording in (tmp_path / "killed" / "trials").iterdir():
        recording.unlink()
    again, same_answers = run(tmp_path / "killed", protocol, 1)
    faults = again[again["status"] == "fault"]
    assert faults[["participant", "trial", "attempt"]].values.tolist() == [[1, first.trial, 1]]
    complete = again[again["status"] == "complete"].reset_index(drop=True)
    assert complete["excluded"].isna().all()
    others = ["attempt", "recording", "excluded"]
    pandas.testing.assert_frame_equal(complete.drop(columns=others), trials.drop(columns=others), check_dtype=False)
    pandas.testing.assert_frame_equal(same_answers, answers)
