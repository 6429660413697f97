"""The report as files: the same bytes, everything inside, and each person and trial accounted for."""

import re
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pandas as pd
import pytest

from common import extras
from common.errors import ConfigurationError
from feelahead.study.folder import MADE_ANEW
from feelahead.study.report import summaries
from feelahead.study.report.contrasts import compare
from feelahead.study.report.outcomes import Tables
from feelahead.study.report.page import page
from feelahead.study.report.writing import write_report
from tests.feelahead.study.made_up import PROTOCOL, made_up


@pytest.fixture(scope="module")
def tables() -> Tables:
    """A study of four with one fault, one exclusion, a fifth who withdrew, and a sixth who began no trial."""
    made = made_up(people=4)
    trials = made.trials
    again = trials.loc[[8]].assign(attempt=2)
    trials.loc[8, "status"] = "fault"
    trials.loc[20, "excluded"] = "a <phone> rang"
    named = replace(PROTOCOL, name="Study of <b>four</b>")
    return Tables(named, pd.concat([trials, again], ignore_index=True), made.answers, (5,), (*range(1, 7),))


def test_the_page_has_everything_inside_and_the_same_bytes_again(tables: Tables, tmp_path: Path) -> None:
    (tmp_path / "again").mkdir()
    written = write_report(replace(tables, simulated=True), tmp_path)
    text = written.read_text(encoding="utf-8")
    assert write_report(replace(tables, simulated=True), tmp_path / "again").read_bytes() == written.read_bytes()
    assert {path.name for path in tmp_path.glob("*.*")} == {*MADE_ANEW}
    assert set(re.findall(r'(?:src|href)="([^,"]*)', text)) == {"data:image/svg+xml;base64"}
    assert text.count("<img") == 4
    assert "Study of &lt;b&gt;four&lt;/b&gt;" in text
    assert "<phone>" not in text
    assert "a &lt;phone&gt; rang" in text
    assert "Simulated participants" in text
    assert "Simulated participants" not in page(tables, ())
    assert "The orders of conditions are unequal" not in text
    contrasts = pd.read_parquet(tmp_path / "contrasts.parquet")
    assert list(contrasts.p_exact) == [one.p_exact for one in compare(tables)]
    assert len(pd.read_parquet(tmp_path / "trials.parquet")) == len(tables.trials)


def test_each_person_and_trial_is_accounted_for(tables: Tables) -> None:
    trials = tables.trials[tables.trials.participant != 2]
    said = page(replace(tables, trials=trials), ())
    assert "The orders of conditions are unequal: of those who count, 0 to 1 had each order." in said
    counts = dict(summaries.flow(tables, compare(tables)))
    assert counts["participants who were enrolled"] == 6
    assert counts["of these without a trial in the data"] == 2
    assert counts["participants who withdrew (data: remove)"] == 1
    assert counts["other trials that were begun"] == 4 * 72 + 1
    assert (counts["of these fault"], counts["complete, and excluded"]) == (1, 1)
    assert counts["trials that count"] == 4 * 72 - 1
    assert counts["trials that count in a full study of all planned"] == 12 * 72
    out = summaries.left_out(tables)
    assert list(zip(out.status, out.excluded.fillna(""), strict=True)) == [
        ("fault", ""),
        ("complete", "a <phone> rang"),
    ]
    assert summaries.places(tables).to_numpy().tolist() == [[1] * 4] * 4


def test_cells_are_means_of_participants_means(tables: Tables) -> None:
    cells = summaries.cells(tables)
    [row] = cells[(cells.outcome == "hit") & (cells.condition == "off") & (cells.delay_ms == 100.0)].itertuples()
    rows = tables.analysed
    own = rows[(rows.condition == "off") & (rows.delay_ms == 100.0)].groupby("participant").hit.mean()
    assert row.value == pytest.approx(own.mean())
    assert row.participants == 4
    assert row.low <= row.value <= row.high


def test_a_study_in_which_nothing_was_done_has_a_page(tmp_path: Path) -> None:
    made = made_up(people=1)
    empty = Tables(PROTOCOL, made.trials.iloc[:0], made.answers.iloc[:0])
    text = write_report(empty, tmp_path).read_text(encoding="utf-8")
    assert "no pair of trials; nothing can be said" in text


def test_without_the_extra_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(extras, "find_spec", lambda name: None if name == "statsmodels" else find_spec(name))
    with pytest.raises(ConfigurationError, match=r"^study report: statsmodels is not installed; .*\[study\]'  # in"):
        write_report(made_up(people=1), tmp_path)
