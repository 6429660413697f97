"""Boot a stock Debian kernel in QEMU, and let pytest run the tests of `inside/` there: `make test-kernel`."""

import compileall
import os
import shlex
import sys
from pathlib import Path

import pytest

from tests.helpers.repository import ROOT
from tests.kernel.machine import run_machine
from tests.kernel.packages import provide
from tests.kernel.ramdisk import WRITABLE, make_ramdisk, module_order

pytestmark = [pytest.mark.kernel, pytest.mark.processes]

_INSIDE = Path(__file__).parent / "inside"
_FILES = ("operator_side.py", "command.py", "layouts.py", "gamepad.py", "driver.py", "device.py")
"""Test files in the order in which they run; the last two leave a controller plugged in"""
_LIMIT_S = 3600.0
_LAST_WORDS = 25


def test_its_own_driver_and_ours_drive_a_controller(tmp_path: Path) -> None:
    """The environment variable INSIDE may hold arguments for the pytest inside, such as -k. Its report is printed."""
    parts = provide()
    command = [
        # An operator side with raised priority would leave an emulated processor to nobody else.
        *("/usr/bin/setpriv", "--bounding-set=-sys_nice"),
        *("/usr/bin/env", "-i", f"PATH={Path(sys.executable).parent}:/usr/bin:/bin"),
        *(f"HOME={WRITABLE}", f"TMPDIR={WRITABLE}", "PYTEST_DISABLE_PLUGIN_AUTOLOAD=1"),
        *("PYTHONDONTWRITEBYTECODE=1", f"PYTHONPATH={ROOT}", "PYTHONUNBUFFERED=1", "LANG=C.UTF-8"),
        *(sys.executable, "-P", "-m", "pytest", "--rootdir", str(ROOT), "--confcutdir", str(_INSIDE)),
        *("-v", "-s", "--durations=5", "-p", "no:cacheprovider"),
        *(str(_INSIDE / name) for name in _FILES),
        *shlex.split(os.environ.get("INSIDE", "")),
    ]
    # The guest cannot write, and would compile all of it each time.
    for package in ("common", "operator_side", "robot_side", "feelahead", "tests"):
        compileall.compile_dir(ROOT / package, quiet=2)
    ramdisk, console = tmp_path / "ramdisk.gz", tmp_path / "console.log"
    ramdisk.write_bytes(make_ramdisk(parts.busybox, module_order(parts.modules), command))
    print(f"booting {parts.kernel.name.removeprefix('vmlinuz-')}", flush=True)
    code = None
    try:
        code = run_machine(parts, ramdisk, console, _LIMIT_S)
    finally:
        if code != 0 and console.exists():
            print("the kernel's last words:")
            print("\n".join(console.read_text(errors="replace").splitlines()[-_LAST_WORDS:]))
    assert code == 0
