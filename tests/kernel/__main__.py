"""Boot the kernel and run the test program in it: `python -m tests.kernel`."""

import argparse
import sys
import time
from pathlib import Path

from tests.kernel.machine import MachineError, run_machine
from tests.kernel.packages import default_cache, provide
from tests.kernel.ramdisk import WRITABLE, make_ramdisk, module_order
from tests.kernel.skipped import SkippedError

_PROJECT = Path(__file__).parents[2]


def main() -> int:
    """0 when the test passed or was skipped, which the last line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.kernel", description=__doc__)
    parser.add_argument("--cache", type=Path, default=default_cache(), help="where the packages are kept (%(default)s)")
    parser.add_argument("--limit", type=float, default=240.0, metavar="S", help="give up after so long (%(default)s s)")
    parser.add_argument("only", nargs="*", help="words: run only the checks whose names contain one of them")
    given = parser.parse_args()
    started_s = time.monotonic()
    cache = given.cache.absolute()
    try:
        cache.mkdir(parents=True, exist_ok=True)
        parts = provide(cache)
    except SkippedError as reason:
        print(f"skipped: {reason}")
        return 0
    command = [
        *("env", "-i", f"PATH={Path(sys.executable).parent}:/usr/bin:/bin", f"HOME={WRITABLE}", f"TMPDIR={WRITABLE}"),
        *("PYTHONDONTWRITEBYTECODE=1", f"PYTHONPATH={_PROJECT}", "PYTHONUNBUFFERED=1", "LANG=C.UTF-8"),
        *(sys.executable, "-P", "-m", "tests.kernel.guest", *given.only),
    ]
    modules = module_order(parts.modules)
    ramdisk, console = cache / "ramdisk.gz", cache / "console.log"
    ramdisk.write_bytes(make_ramdisk(parts.busybox, modules, command))
    print(f"booting {parts.kernel.name.removeprefix('vmlinuz-')}", flush=True)
    try:
        code = run_machine(parts, ramdisk, console, given.limit, lambda line: print(f"  {line}", flush=True))
    except MachineError as error:
        print(f"failed: {error}; the kernel's last words ({console}):")
        print("\n".join(console.read_text(errors="replace").splitlines()[-15:]))
        return 1
    print(f"{'passed' if code == 0 else f'failed with code {code}'} in {time.monotonic() - started_s:.0f} s")
    return 0 if code == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
