"""What `make test-netem` makes of its machine and its recordings; the machine itself takes too long for here."""

from pathlib import Path

import numpy as np
import pytest

from common.arrays import FloatArray
from common.emulation.profile import LinkProfile
from feelahead.lab.link.samples import LinkSample, play
from tests.kernel.machine import MachineError
from tests.kernel.skipped import SkippedError
from tests.netem.cases import CASES, Case
from tests.netem.stalls import stalled
from tests.netem.uml import Parts, run_machine
from tests.netem.verdicts import compare_with_model, table

PERIOD_S = 1e-3
NORMAL = next(case for case in CASES if case.name == "normal")
STREAM = next(case for case in CASES if case.name == "stream-normal")


def run(folder: Path, script: str) -> tuple[int, list[str]]:
    """A machine that runs `script` instead of a kernel."""
    kernel = folder / "linux"
    kernel.write_text(f"#!/bin/sh\n{script}\n")
    kernel.chmod(0o755)
    (folder / "modules.builtin").write_text("kernel/drivers/net/veth.ko\nkernel/net/sched/sch_netem.ko\n")
    lines: list[str] = []
    return run_machine(Parts(kernel, folder, {}), folder, ["normal"], 30.0, lines.append), lines


@pytest.mark.processes
def test_the_programs_exit_code_is_the_machines(tmp_path: Path) -> None:
    script = "echo 'netem test: booted'; echo recorded; echo 'kernel test: exit code 3'"
    assert run(tmp_path, f"echo early; {script}") == (3, ["recorded"])


@pytest.mark.processes
def test_a_machine_that_does_not_boot_is_skipped_and_one_that_dies_has_failed(tmp_path: Path) -> None:
    with pytest.raises(SkippedError, match="does not boot here: no ptrace"):
        run(tmp_path, "echo no ptrace; exit 1")
    with pytest.raises(MachineError, match="ended with code 1"):
        run(tmp_path, "echo 'netem test: booted'; exit 1")


def recording(case: Case, seed: int, added_s: float = 0.0) -> LinkSample:
    profile = LinkProfile.parse(case.netem, seed, case.model)
    sample = play(profile, (PERIOD_S * np.arange(case.messages)).tolist(), 142)[0]
    return LinkSample(sample.sent_s, sample.delay_s + added_s)


@pytest.mark.parametrize(("case", "too_much_s"), [(NORMAL, 0.5e-3), (STREAM, 3e-3)])
def test_the_model_is_like_itself_and_unlike_a_slower_one(case: Case, too_much_s: float) -> None:
    alike = compare_with_model(case, recording(case, 99), 0.0)
    slower = compare_with_model(case, recording(case, 99, too_much_s), 0.0)
    assert (alike.verdict, slower.verdict) == ("met", "missed")
    assert [row[-1] for row in table([alike, slower], 0.0).rows] == ["met", "missed"]


def test_a_miss_on_a_host_that_stalls_is_not_judged() -> None:
    sample = recording(NORMAL, 99, 0.5e-3)
    stops = np.arange(sample.sent_s.size) % 10 == 0
    assert compare_with_model(NORMAL, LinkSample(sample.sent_s + 0.9e-3 * stops, sample.delay_s), 0.0).verdict == (
        "not judged"
    )


def test_what_was_under_way_during_a_stall_is_left_out() -> None:
    even_s: FloatArray = PERIOD_S * np.arange(20, dtype=np.float64)
    sent_s, delay_s = even_s.copy(), np.full(20, 2.2e-3)
    sent_s[10] += 0.9e-3  # overdue from 10 to 10.9 ms, when the message of 8 ms arrives
    assert np.flatnonzero(stalled(LinkSample(sent_s, delay_s), PERIOD_S)).tolist() == [8, 9]
    assert not stalled(LinkSample(even_s, delay_s), PERIOD_S).any()
