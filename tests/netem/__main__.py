"""Record what the kernel's netem does to messages in User-Mode Linux, and compare: `python -m tests.netem`."""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console

from feelahead.benchmarks.report import short, show
from feelahead.lab.link.samples import LinkSample, read_link_sample
from tests.kernel.debian import default_cache
from tests.kernel.machine import MachineError
from tests.kernel.skipped import SkippedError
from tests.netem.cases import CASES, PATH_CASE, Case
from tests.netem.uml import Parts, provide, run_machine
from tests.netem.verdicts import Comparison, compare_with_model, path_time_s, table

_ATTEMPTS = 3
"""What misses is recorded again: one run in a hundred lies beyond a band of 99 %, and a busy host spoils some."""
_PATIENCE_S = 90.0
"""From then on only what misses is recorded again: a host that is too busy to tell stays so for a while."""
_WIDE = 160


def main() -> int:
    """0 when nothing misses or the test was skipped, which the last line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.netem", description=__doc__)
    parser.add_argument(
        "--cache", type=Path, default=default_cache("netem-test"), help="where packages are kept (%(default)s)"
    )
    parser.add_argument(
        "--limit", type=float, default=120.0, metavar="S", help="give up on a boot after so long (%(default)s s)"
    )
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="write the recordings there")
    parser.add_argument("only", nargs="*", help=f"which links: {', '.join(case.name for case in CASES)}; all if none")
    given = parser.parse_args()
    unknown = set(given.only) - {case.name for case in CASES}
    if unknown:
        parser.error(f"unknown link {min(unknown)!r}; valid: {', '.join(case.name for case in CASES)}")
    started_s = time.monotonic()

    def say(line: str) -> None:
        print(f"{time.monotonic() - started_s:5.0f} s  {line}", flush=True)

    cases = [case for case in CASES if not given.only or case.name in given.only]
    with tempfile.TemporaryDirectory(prefix="feelahead-netem-") as temporary:
        folder = Path(temporary) if given.keep is None else given.keep.absolute()
        folder.mkdir(parents=True, exist_ok=True)
        try:
            comparisons, path_s = _compare(provide(given.cache.absolute()), folder, cases, given.limit, say)
        except SkippedError as reason:
            print(f"skipped: {reason}")
            return 0
        except MachineError as error:
            print(f"failed: {error}")
            return 1
    show(Console(width=_WIDE), table(comparisons, path_s))
    missed = [one for one in comparisons if one.verdict == "missed"]
    unjudged = [one.case.name for one in comparisons if one.verdict == "not judged"]
    if unjudged:
        print(f"not judged, because the host stalled too often: {', '.join(unjudged)}")
    if missed:
        print(f"failed: {'; '.join(_explain(one) for one in missed)}")
        return 1
    print(f"passed in {time.monotonic() - started_s:.0f} s")
    return 0


def _compare(
    parts: Parts, folder: Path, cases: Sequence[Case], limit_s: float, say: Callable[[str], None]
) -> tuple[list[Comparison], float]:
    """Every case and the path's own time; what misses is recorded again, and counts as on the last quiet host."""
    started_s = time.monotonic()
    found: dict[str, Comparison] = {}
    wanted = list(cases)
    path_s = 0.0
    for attempt in range(_ATTEMPTS):
        if not wanted:
            break
        code = run_machine(parts, folder, [PATH_CASE.name, *(case.name for case in wanted)], limit_s, say)
        if code != 0:
            raise MachineError(f"the program in the machine ended with code {code}")
        path_s = path_time_s(_read(folder, PATH_CASE))
        for case in wanted:
            one = compare_with_model(case, _read(folder, case), path_s)
            if one.quiet or case.name not in found or not found[case.name].quiet:
                found[case.name] = one
        again = {"missed"} if time.monotonic() - started_s > _PATIENCE_S else {"missed", "not judged"}
        wanted = [case for case in cases if found[case.name].verdict in again]
        for case in wanted:
            say(f"{found[case.name].verdict} at attempt {attempt + 1}: {_explain(found[case.name])}")
    return [found[case.name] for case in cases], path_s


def _read(folder: Path, case: Case) -> LinkSample:
    return read_link_sample(folder / case.file, case.name)


def _explain(one: Comparison) -> str:
    goals = [f"{goal.claim} {short(goal.value or 0.0)}, {goal.compare} {short(goal.limit)}" for goal in one.missed]
    return f"{one.case.name}: {', '.join(goals)}"


if __name__ == "__main__":
    sys.exit(main())
