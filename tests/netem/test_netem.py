"""Compare the kernel's netem, recorded in User-Mode Linux, with our model for the same times of sending."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from common.arrays import FloatArray
from common.emulation.profile import LinkProfile
from feelahead.lab.link.samples import (
    LinkSample,
    band_of,
    compare_one,
    independent_delays,
    judge,
    pair_of_runs,
    play,
    read_link_sample,
)
from tests.netem.cases import CASES, PATH_CASE, PAYLOAD_BYTES, PERIOD_NS, Case
from tests.netem.stalls import stalled
from tests.netem.uml import provide, run_machine

pytestmark = [pytest.mark.netem, pytest.mark.processes]

ATTEMPTS = 3
"""Maximum number of recordings of a case; one that agrees is enough.

One run in a hundred is beyond a band of 99 % by chance, and a busy host spoils some.
"""
SEEDS, PAIRS = 20, 100
STREAM_MEAN_MS, STREAM_SD_MS = 2.0, 1.0
QUIET_SHARE = 0.05
"""Maximum share of messages delayed by the host at which a difference is judged at all"""
HEADERS_BYTES = 42


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_ours_is_like_the_kernels(case: Case, tmp_path: Path) -> None:
    parts = provide()
    missed: list[str] = []
    quiet = False
    for _ in range(ATTEMPTS):
        run_machine(parts, tmp_path, [PATH_CASE, case])
        path = read_link_sample(tmp_path / PATH_CASE.file, PATH_CASE.name)
        path_s = float(np.median(path.arrived_s)) - LinkProfile.parse(PATH_CASE.netem).delay_s
        found, held_up = missed_goals(case, read_link_sample(tmp_path / case.file, case.name), path_s)
        if not found:
            return
        this_quiet = held_up <= QUIET_SHARE * case.messages
        if this_quiet or not quiet:
            missed, quiet = found, this_quiet
        print(f"missed, {held_up} of {case.messages} messages held up by the host: {'; '.join(found)}")
    if not quiet:
        pytest.skip(f"not judged, because the host stalled too often: {'; '.join(missed)}")
    assert not missed


def missed_goals(case: Case, sample: LinkSample, path_s: float) -> tuple[list[str], int]:
    """Return where model and recording differ too much, and the number of messages left out for stalls of the host.

    path_s: delay of a datagram besides netem's.
    """
    profile = LinkProfile.parse(case.netem, 0, case.model)
    size_bytes = PAYLOAD_BYTES + HEADERS_BYTES
    own_s = path_s if case.model == "datagram" and profile.delay_s > 0.0 else 0.0
    delay_s, held_up = np.maximum(0.0, sample.delay_s - own_s), 0
    kept = LinkSample(sample.sent_s, delay_s)
    if profile.loss is None:  # The loss of a message does not depend on when the machine runs.
        late = stalled(sample, 1e-9 * PERIOD_NS)
        kept, beyond = LinkSample(sample.sent_s, np.where(late, np.nan, delay_s)).without_stalls(profile)
        held_up = int(late.sum()) + beyond
    if case.model == "stream":
        sent_s = kept.sent_s.tolist()
        runs = [play(dataclasses.replace(profile, seed=seed), sent_s, size_bytes)[0] for seed in range(SEEDS)]
        theirs = _figures_ms(kept)
        ours = np.median([_figures_ms(run) for run in runs], axis=0)
        print(f"{case.name}: mean, sd and p99 of netem {theirs.round(2)} ms, ours {ours.round(2)} ms")
        apart = zip(("mean", "sd"), np.abs(ours - theirs), (STREAM_MEAN_MS, STREAM_SD_MS), strict=False)
        missed = [f"{name} {far_ms:.2f} ms apart" for name, far_ms, most in apart if case.judged and far_ms > most]
    else:
        results = [compare_one(profile, kept, seed, size_bytes) for seed in range(SEEDS)]
        pairs = () if independent_delays(profile) else range(PAIRS)
        found = [pair_of_runs(profile, kept, pair, size_bytes) for pair in pairs]
        band = band_of(found) if found else None
        goals = judge(profile, kept, results, band)
        said = [f"{goal.claim}: {goal.value}, {goal.compare} {goal.limit}" for goal in goals]
        print(f"{case.name}: {'; '.join(said)}")
        missed = [one for one, goal in zip(said, goals, strict=True) if goal.verdict != "met"]
    return missed, held_up


def _figures_ms(sample: LinkSample) -> FloatArray:
    """Return mean, standard deviation and 99 % quantile of the delays, in milliseconds."""
    return 1e3 * np.array([sample.mean_s, sample.sd_s, np.quantile(sample.arrived_s, 0.99)])
