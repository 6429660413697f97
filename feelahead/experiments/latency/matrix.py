"""Every trial of the matrix, one after the other, and what was kept of an earlier run."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import asdict, dataclass
from importlib import import_module
from itertools import product
from typing import Any, Final

from common.errors import ConfigurationError, FeelaheadError
from feelahead.both_sides.trial import Medium, Trial, TrialFigures, WayFigures
from feelahead.experiments.latency.media import LoopbackMedium, VirtualMedium
from feelahead.experiments.latency.settings import LatencySettings
from feelahead.lab.approaches.kept import Kept
from feelahead.lab.progress import progress

_CONTAINERS: Final = "feelahead.containers.medium"
_HERE: Final[Mapping[str, type[VirtualMedium | LoopbackMedium]]] = {
    "virtual": VirtualMedium,
    "loopback": LoopbackMedium,
}


@dataclass(frozen=True)
class Row:
    """One trial that could be done."""

    medium: str
    trial: Trial
    figures: TrialFigures


@contextmanager
def media(settings: LatencySettings) -> Iterator[Sequence[Medium]]:
    """Those that are asked for, for as long as they are needed."""
    with ExitStack() as stack:
        found: list[Medium] = [_HERE[name]() for name in settings.media]
        if settings.compose:
            found.append(stack.enter_context(_open_containers()))
        yield found


def _open_containers() -> AbstractContextManager[Medium]:
    try:
        opened: AbstractContextManager[Medium] = import_module(_CONTAINERS).open_medium()
    except ImportError as error:
        raise ConfigurationError(f"--compose: {error}; valid: in a clone of the repository") from error
    return opened


def run_matrix(settings: LatencySettings, where: Sequence[Medium]) -> tuple[list[Row], list[str]]:
    """Links, haptics and seeds in each of the media; what came of it, and what failed, in words.

    All of one seed before the next, so that a run that is broken off has whole pairs.
    """
    keys = [
        (medium, _trial(settings, link, haptics, seed))
        for seed, link, haptics, medium in product(range(settings.seeds), settings.links, settings.haptics, where)
    ]
    same = {name: getattr(settings, name) for name in ("model", "force", "duration")}
    kept = Kept(settings.resume, {"latency": same})
    rows, failed = [], []
    try:
        with progress("trials", float(len(keys))) as advance:
            for medium, trial in keys:
                name = f"{trial.link}/{'on' if trial.haptics else 'off'}/{trial.seed}/{medium.name}"
                try:
                    if name not in kept.done:
                        kept.keep(name, [asdict(medium.run(trial))])
                    rows.append(Row(medium.name, trial, _read(kept.done[name][0])))
                except ConfigurationError:
                    raise
                except FeelaheadError as error:
                    failed.append(f"{name}: {error}")
                    sys.stderr.write(f"{failed[-1]}\n")
                advance(1.0)
    finally:
        kept.close()
    return rows, failed


def _trial(settings: LatencySettings, link: str, haptics: str, seed: int) -> Trial:
    return Trial(link, haptics == "on", seed, settings.force, settings.duration, settings.model)


def _read(record: Mapping[str, Any]) -> TrialFigures:
    ways = {name: WayFigures(**record[name]) for name in ("to_robot", "to_operator")}
    return TrialFigures(**(dict(record) | ways))
