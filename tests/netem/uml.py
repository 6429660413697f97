"""User-Mode Linux: a Linux kernel with netem that runs as an ordinary process. It can read the host's files only."""

import contextlib
import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.helpers.machines.debian import Apt, library_path, only, unpacked
from tests.helpers.repository import ROOT
from tests.kernel.machine import MachineError, follow
from tests.kernel.ramdisk import RESULT_MARK, module_order
from tests.netem.cases import Case

_MODULES = ("veth", "sch_netem")
_MEMORY = "256M"
_EXCHANGE = "/mnt"
_BOOTED = "netem test: booted"
_LIMIT_S = 120.0

_INIT = """\
#!/bin/sh
echo "{booted}"
mount -t proc proc /proc
mount -t sysfs sys /sys
mount -t tmpfs tmpfs /run
mount -t hostfs -o {folder} none {exchange}
{command}
echo "{mark}$?"
echo o > /proc/sysrq-trigger
sleep 10
"""


@dataclass(frozen=True, slots=True)
class Parts:
    """Parts of the User-Mode Linux machine."""

    kernel: Path
    modules: Path
    """Folder with the modules of this kernel"""
    environment: dict[str, str]
    """Environment variables by which `ip`, `tc`, and their libraries and tables are found"""


def provide() -> Parts:
    """Return the parts installed on the system, or else downloaded ones; skip the test if they cannot be had."""
    try:
        return _found(Path("/"))
    except FileNotFoundError:
        return unpacked("netem", _packages, _found)


def _packages(apt: Apt) -> list[str]:
    return [name for package in ("user-mode-linux", "iproute2") for name in apt.missing_for(package)]


def _found(root: Path) -> Parts:
    """Find the parts in `root`, or on the system; FileNotFoundError if one is in neither."""
    kernel = _first(root, "usr/bin/linux.uml")
    modules = only(kernel.parents[1] / "lib/uml/modules", "*")
    places = ("usr/sbin", "sbin", "usr/bin", "bin")
    tools = {str(_first(root, *(f"{place}/{name}" for place in places)).parent) for name in ("tc", "ip")}
    tables = _first(root, "usr/lib/x86_64-linux-gnu/tc/normal.dist", "usr/lib/tc/normal.dist").parent
    path = ":".join([*sorted(tools), "/usr/sbin", "/usr/bin", "/sbin", "/bin"])
    environment = {"PATH": path, "TC_LIB_DIR": str(tables)}
    return Parts(kernel, modules, environment if root == Path("/") else environment | library_path(root))


def _first(root: Path, *places: str) -> Path:
    for folder in (root, Path("/")):
        for place in places:
            if (folder / place).exists():
                return folder / place
    raise FileNotFoundError(places[0])


@contextlib.contextmanager
def _alone() -> Iterator[None]:
    """Let child processes run on one processor only, with real-time priority if permitted.

    The machine's processes wake each other all the time: on two processors a run takes three times as long.
    """
    processors = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(processors)})
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        os.sched_setaffinity(0, processors)


def run_machine(parts: Parts, folder: Path, cases: Sequence[Case]) -> None:
    """Boot the machine and record `cases` into `folder`; skip the test if the machine does not boot here."""
    said: list[str] = []
    modules = [str(path) for path in module_order(parts.modules, _MODULES).values()]
    variables = parts.environment | {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1", "LANG": "C.UTF-8"}
    command = ["/usr/bin/env", "-i", *(f"{name}={value}" for name, value in variables.items())]
    command += [sys.executable, "-B", "-P", "-m", "tests.netem.guest", _EXCHANGE, ",".join(modules)]
    command += [case.name for case in cases]
    init = folder / "init"
    init.write_text(
        _INIT.format(folder=folder, exchange=_EXCHANGE, command=shlex.join(command), mark=RESULT_MARK, booted=_BOOTED)
    )
    init.chmod(0o755)
    boot = [
        str(parts.kernel),
        *(f"mem={_MEMORY}", "root=/dev/root", "rootfstype=hostfs", "rootflags=/", "ro", f"init={init}"),
        *("con=null", "con0=null,fd:1", "quiet", "loglevel=1"),
    ]
    with _alone():
        machine = subprocess.Popen(
            boot,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    with machine:
        try:
            assert follow(machine, _LIMIT_S, said.append) == 0, said[-20:]
        except MachineError as error:
            if _BOOTED in said:
                raise
            pytest.skip(f"User-Mode Linux does not boot here: {said[-1] if said else error}")
        finally:
            # Each of its programs is a process of the host, too.
            with contextlib.suppress(ProcessLookupError):
                os.killpg(machine.pid, signal.SIGKILL)
