"""Boot the kernel and run the test program in it: `python -m tests.kernel`."""

import argparse
import compileall
import shutil
import sys
import tempfile
import time
from pathlib import Path

from tests.kernel.debian import default_cache
from tests.kernel.machine import MachineError, run_machine
from tests.kernel.packages import provide
from tests.kernel.ramdisk import WRITABLE, make_ramdisk, module_order
from tests.kernel.skipped import SkippedError

_PROJECT = Path(__file__).parents[2]
_LAST_WORDS = 25


def main() -> int:
    """0 when the test passed or was skipped, which the last line says."""
    parser = argparse.ArgumentParser(prog="python -m tests.kernel", description=__doc__)
    parser.add_argument(
        "--cache", type=Path, default=default_cache("kernel-test"), help="where the packages are kept (%(default)s)"
    )
    parser.add_argument("--limit", type=float, default=900.0, metavar="S", help="give up after so long (%(default)s s)")
    parser.add_argument("--console", type=Path, metavar="FILE", help="write the kernel's messages there")
    parser.add_argument("only", nargs="*", help="words: run only the checks whose names contain one of them")
    given = parser.parse_args()
    started_s = time.monotonic()

    def said(line: str) -> None:
        print(f"{time.monotonic() - started_s:5.0f} s  {line}", flush=True)

    cache = given.cache.absolute()
    try:
        parts = provide(cache)
    except SkippedError as reason:
        print(f"skipped: {reason}")
        return 0
    command = [
        # An operator side that went before all else would leave an emulated processor to nobody else.
        *("/usr/bin/setpriv", "--bounding-set=-sys_nice"),
        *("/usr/bin/env", "-i", f"PATH={Path(sys.executable).parent}:/usr/bin:/bin"),
        *(f"HOME={WRITABLE}", f"TMPDIR={WRITABLE}"),
        *("PYTHONDONTWRITEBYTECODE=1", f"PYTHONPATH={_PROJECT}", "PYTHONUNBUFFERED=1", "LANG=C.UTF-8"),
        *(sys.executable, "-P", "-m", "tests.kernel.guest", *given.only),
    ]
    # The guest cannot write, and would compile all of it each time.
    for package in ("common", "operator_side", "robot_side", "feelahead", "tests/kernel"):
        compileall.compile_dir(_PROJECT / package, quiet=2)
    modules = module_order(parts.modules)
    print(f"booting {parts.kernel.name.removeprefix('vmlinuz-')}", flush=True)
    with tempfile.TemporaryDirectory(prefix="feelahead-kernel-") as folder:
        ramdisk, console = Path(folder) / "ramdisk.gz", Path(folder) / "console.log"
        ramdisk.write_bytes(make_ramdisk(parts.busybox, modules, command))
        try:
            code = run_machine(parts, ramdisk, console, given.limit, said)
            outcome = "passed" if code == 0 else f"failed with code {code}"
        except MachineError as error:
            outcome = f"failed: {error}"
        if outcome != "passed" and console.exists():
            print("the kernel's last words:")
            print("\n".join(console.read_text(errors="replace").splitlines()[-_LAST_WORDS:]))
        if given.console is not None and console.exists():
            shutil.copy(console, given.console)
    print(f"{outcome} in {time.monotonic() - started_s:.0f} s")
    return 0 if outcome == "passed" else 1


if __name__ == "__main__":
    sys.exit(main())
