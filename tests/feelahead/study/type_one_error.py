"""Does the report find what is not there, and as often what is there as the plan promises?

python -m tests.feelahead.study.type_one_error --resamples 1000 --studies 200
"""

import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from scipy.stats import binomtest

from common.command.command_line import parse_settings, run_command
from common.command.launch import single_threaded_algebra
from feelahead.study.protocol import Contrast
from feelahead.study.report.contrasts import Compared, compare
from feelahead.study.report.outcomes import Tables
from feelahead.study.report.power import LEVEL, plan
from feelahead.study.report.reading import read_tables
from feelahead.study.report.words import named
from tests.feelahead.study.made_up import NONE, PROTOCOL, Effects, made_up

PROGRAM: Final = "python -m tests.feelahead.study.type_one_error"
ASKED: Final = replace(
    PROTOCOL,
    contrasts=(
        Contrast("hit", "off", "swept"),
        Contrast("time_s", "off", "swept"),
        Contrast("impulse_n_s", "margin", "swept"),
    ),
)
MODERATE: Final = Effects(
    {"off": -1.0, "swept": -2.0, "margin": -1.0, "assist": -2.0},
    {"off": 0.0, "swept": 0.12, "margin": 0.1, "assist": 0.1},
)
"""Effects that a study of twelve finds often and not always"""


@dataclass(frozen=True)
class TypeOneError:
    """Count errors of the report's tests in resampled studies."""

    resamples: int = 1_000
    """Studies without an effect, each participant's conditions under changed names"""
    from_effects: bool = False
    """Draw these from a pool with effects: so with their names changed, persons differ much"""
    studies: int = 200
    """Studies with an effect, whose power is held against the plan's promise"""
    participants: int = 12
    """Participants of each study"""
    pool: int = 100
    """Made-up participants from whom they are drawn"""
    folder: Path | None = None
    """Folder of a study with simulated persons, from whom they are drawn instead"""
    seed: int = 0


@dataclass(frozen=True)
class Errors:
    """Number of studies with a p of at most 5 %, of each kind, in one contrast."""

    contrast: Contrast
    model: int
    exact: int
    interval: int
    """The bootstrap's interval leaves out what no effect would be"""
    corrected: int
    """After Holm's correction"""


def resampled(pool: Tables, people: int, generator: np.random.Generator, *, without_effect: bool) -> Tables:
    """Return a study of participants drawn from the pool; without effect, each one's conditions change their names."""
    conditions = list(pool.protocol.conditions)
    people_drawn = generator.choice(sorted({*pool.trials.participant}), people)
    names = [
        dict(zip(conditions, generator.permutation(conditions).tolist() if without_effect else conditions, strict=True))
        for _ in people_drawn
    ]

    def drawn(frame: pd.DataFrame) -> pd.DataFrame:
        by_person = dict(iter(frame.groupby("participant")))
        parts = [
            by_person.get(person, frame.iloc[:0]).assign(participant=number)
            for number, person in enumerate(people_drawn, start=1)
        ]
        changed = [part.assign(condition=part.condition.map(own)) for part, own in zip(parts, names, strict=True)]
        return pd.concat(changed, ignore_index=True)

    return Tables(pool.protocol, drawn(pool.trials), drawn(pool.answers))


def compared(
    pool: Tables, people: int, studies: int, seed: int, *, without_effect: bool
) -> Iterator[tuple[Compared, ...]]:
    generator = np.random.default_rng(seed)
    return (compare(resampled(pool, people, generator, without_effect=without_effect)) for _ in range(studies))


def errors(studies: Sequence[tuple[Compared, ...]]) -> tuple[Errors, ...]:
    return tuple(
        Errors(
            found[0].contrast,
            model=_at_level(one.fit.p for one in found),
            exact=_at_level(one.p_exact for one in found),
            interval=sum(not _holds_nothing(one) for one in found),
            corrected=_at_level(one.p_holm for one in found),
        )
        for found in zip(*studies, strict=True)
    )


def _at_level(ps: Iterable[float | None]) -> int:
    return sum(p is not None and p <= LEVEL for p in ps)


def _holds_nothing(one: Compared) -> bool:
    """Return whether the effect's interval holds no effect."""
    none = 1.0 if one.effect.measure == "ratio" else 0.0
    return one.effect.low is None or one.effect.high is None or one.effect.low <= none <= one.effect.high


def _share(count: int, of: int) -> str:
    interval = binomtest(count, of).proportion_ci(0.95, method="exact")
    return f"{count} of {of} ({100 * count / of:.1f} %, {100 * interval.low:.1f} to {100 * interval.high:.1f})"


def main(arguments: Sequence[str]) -> int:
    asked = parse_settings(TypeOneError, PROGRAM, arguments)
    drawn_from = None if asked.folder is None else read_tables(asked.folder)
    if asked.resamples:
        pool = drawn_from or made_up(MODERATE if asked.from_effects else NONE, ASKED, asked.pool, seed=asked.seed + 1)
        studies = [*compared(pool, asked.participants, asked.resamples, asked.seed, without_effect=True)]
        sys.stdout.write(f"without an effect, {asked.participants} participants\n")
        for one in errors(studies):
            figures = [f"{kind} {_share(getattr(one, kind), len(studies))}" for kind in ("model", "exact", "interval")]
            sys.stdout.write(f"  {named(one.contrast)}: {'; '.join(figures)}\n")
        wrong = sum(_at_level(one.p_holm for one in study) > 0 for study in studies)
        sys.stdout.write(f"  any contrast after Holm's correction: {_share(wrong, len(studies))}\n")
        _tell_models(studies)
    if not asked.studies:
        return 0
    pool = drawn_from or made_up(MODERATE, ASKED, asked.pool, seed=asked.seed + 2)
    promised = plan(pool, (asked.participants,), effects=(1.0,), resamples=10_000)
    studies = [*compared(pool, asked.participants, asked.studies, asked.seed, without_effect=False)]
    sys.stdout.write(f"power with {asked.participants} participants, after Holm's correction\n")
    found = {one.contrast: one for one in errors(studies)}
    for row in promised.rows:
        one = found[row.contrast]
        sys.stdout.write(
            f"  {named(row.contrast)}: promised {100 * row.power:.1f} %, found {_share(one.corrected, len(studies))}\n"
        )
    return 0


def _tell_models(studies: Sequence[tuple[Compared, ...]]) -> None:
    counts = Counter(f"{one.contrast.outcome}: {one.fit.model}" for study in studies for one in study)
    sys.stdout.write("".join(f"  {count} × {name}\n" for name, count in sorted(counts.items())))


if __name__ == "__main__":
    single_threaded_algebra()
    run_command(PROGRAM, main)
