"""From the plan to the page, with few ticks."""

from pathlib import Path

import pytest

from feelahead.benchmarks.felt.bench import FeltSettings, write_page
from feelahead.benchmarks.felt.errors import errors
from feelahead.benchmarks.felt.ladders import NODES, RATE
from feelahead.benchmarks.felt.measuring import Plan, measure, pieces
from feelahead.benchmarks.felt.tables import report
from feelahead.benchmarks.felt.turning import Turned


@pytest.mark.long
@pytest.mark.processes
def test_each_setting_is_measured_and_shown_and_kernels_are_compiled_otherwise_elsewhere(tmp_path: Path) -> None:
    rungs = {
        RATE: [Turned(RATE, "50 Hz", period_s=0.02), Turned(RATE, "100 Hz")],
        NODES: [Turned(NODES, "3", nodes=3), Turned(NODES, "6")],
    }
    plan = Plan(("place_held",), pull_s=0.6, times=1, scenes=())
    done: list[float] = []
    found = measure(plan, rungs, done.append)
    assert sum(done) == pieces(plan, rungs)
    by_how = {one.how: one for one in found.replayed["place_held"]}
    assert set(by_how) == {how for rung in rungs.values() for how in rung}
    coarse, fine = (by_how[how] for how in rungs[NODES])
    apart = errors(coarse, fine, "fast full")
    # Three overlaps over the margin are not as exact as six; one reads them off a little elsewhere.
    assert apart.count > 100
    assert 1e-6 < apart.p95_mm < 0.5
    seldom = errors(by_how[rungs[RATE][0]], by_how[rungs[RATE][1]], "fast full")
    assert seldom.p95_mm < 0.1
    page = tmp_path / "felt.md"
    write_page(FeltSettings(quick=True, write_docs=page), page, found, rungs, report(found, rungs))
    written = page.read_text(encoding="utf-8")
    assert "feelahead bench felt --quick --write-docs docs/benchmarks/felt.md" in written
    assert written.count("(as it is)") == 2
    assert "](felt.png)" in written
    assert page.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
