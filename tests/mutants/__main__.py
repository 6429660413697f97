"""Change modules a little, one change at a time, and see whether their tests notice: `make mutants`.

The changes are made in a copy of the repository. A change that no test notices is printed, and makes the exit code 1,
unless `accepted.toml` has the reason why none can.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
import tomllib
from fnmatch import fnmatch
from pathlib import Path
from typing import Final

from tests.mutants.made import Mutant, sample

ROOT: Final = Path(__file__).parents[2]
HERE: Final = Path(__file__).parent
PYTHON: Final = ROOT / ".venv" / "bin" / "python"
MARKS: Final = "not (long or install or console or containers or kernel or two_hosts or quiet)"


def main() -> int:
    """Run a sample of mutants; return 0 if none survives without a reason."""
    asked = _arguments()
    tests = _tests_of_modules()
    modules = [module for module in tests if any(fnmatch(module, each) for each in asked.modules)]
    if not modules:
        sys.stderr.write(f"mutants: --modules {' '.join(asked.modules)}: fits none of modules.toml\n")
        return 2
    accepted = tomllib.loads((HERE / "accepted.toml").read_text(encoding="utf-8")).get("survivor", [])
    reasons = {f"{one['module']}: {one['before']} -> {one['after']}": one["reason"] for one in accepted}
    mutants = [one for one in sample(ROOT, modules, asked.number, asked.seed) if asked.line in (None, one.line)]
    counts = dict.fromkeys(("killed", "accepted", "survived"), 0)
    with tempfile.TemporaryDirectory() as folder:
        copy = _copied(Path(folder))
        for module in {Path(one.module).parent: one.module for one in mutants}.values():
            print(f"without any change: the tests of {Path(module).parent}", flush=True)
            if (failed := _failure(copy, module, tests[module], None)) is not None:
                sys.stderr.write(f"mutants: these fail without any change:\n{failed}\n")
                return 1
        for number, mutant in enumerate(mutants, 1):
            began_s = time.monotonic()
            killed = _failure(copy, mutant.module, tests[mutant.module], mutant) is not None
            outcome = "killed" if killed else "accepted" if mutant.name in reasons else "survived"
            counts[outcome] += 1
            print(f"{number}/{len(mutants)} {outcome} {mutant.module}:{mutant.line} {time.monotonic() - began_s:.0f} s")
            if not killed:
                print(f"    - {mutant.before}\n    + {mutant.after}\n    {reasons.get(mutant.name, '')}".rstrip())
            sys.stdout.flush()
    print(f"seed {asked.seed}: {len(mutants)} tried, " + ", ".join(f"{n} {name}" for name, n in counts.items()))
    return int(counts["survived"] > 0)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__)
    parser.add_argument("--seed", type=int, default=0, help="choose another sample")
    parser.add_argument("--number", type=int, default=40, help="number of mutants, at most one a line")
    parser.add_argument("--modules", nargs="+", default=["*"], help="only modules whose path fits, such as '*lease.py'")
    parser.add_argument("--line", type=int, help="only the mutant of this line; --number must be large enough")
    return parser.parse_args()


def _tests_of_modules() -> dict[str, list[str]]:
    """Return the tests of each module in modules.toml; SystemExit if a name there fits no file."""
    found: dict[str, list[str]] = {}
    for room in tomllib.loads((HERE / "modules.toml").read_text(encoding="utf-8"))["room"]:
        for tests in room["tests"]:
            if not (ROOT / tests).exists():
                sys.exit(f"mutants: modules.toml: {tests}: no such tests")
        for pattern in room["modules"]:
            paths = sorted(path for path in ROOT.glob(pattern) if path.name != "__init__.py")
            if not paths:
                sys.exit(f"mutants: modules.toml: {pattern}: fits no file")
            for path in paths:
                own = [
                    str(place / f"test_{path.stem}.py")
                    for place in map(Path, room["tests"])
                    if (ROOT / place / f"test_{path.stem}.py").exists()
                ]
                found[str(path.relative_to(ROOT))] = list(dict.fromkeys([*own, *room["tests"]]))
    return found


def _copied(folder: Path) -> Path:
    """Copy what git knows, as it stands in the working tree."""
    words = ["git", "ls-files", "-z"]
    listed = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes((ROOT / name).read_bytes())
    return folder


def _failure(copy: Path, module: str, tests: list[str], mutant: Mutant | None) -> str | None:
    """Return the end of what pytest said if a test failed, or took more than its processor time; else None."""
    path = copy / module
    before = path.read_text(encoding="utf-8")
    if mutant is not None:
        path.write_text(mutant.code, encoding="utf-8")
    words = [str(PYTHON), "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", "-m", MARKS, *tests]
    try:
        done = subprocess.run(
            words,
            cwd=copy,
            # Bytecode is told apart by whole seconds, in which several mutants may be made.
            env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(copy)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=_MOST_S,
            # A mutant may never end, or want all memory.
            preexec_fn=_limited,  # one thread
            check=False,
        )
    except subprocess.TimeoutExpired:
        return f"not ended after {_MOST_S:.0f} s"
    finally:
        path.write_text(before, encoding="utf-8")
    return None if done.returncode == 0 else done.stdout[-2000:]


_MOST_S: Final = 900.0
_MOST_PROCESSOR_S: Final = 300
_MOST_BYTES: Final = 16 << 30


def _limited() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (_MOST_PROCESSOR_S, _MOST_PROCESSOR_S + 5))
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_BYTES, _MOST_BYTES))


if __name__ == "__main__":
    sys.exit(main())
