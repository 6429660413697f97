"""Virtual machine: QEMU in software, the host's root over 9p, and two serial lines."""

import os
import selectors
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from tests.kernel.packages import Parts
from tests.kernel.ramdisk import RESULT_MARK


class MachineError(AssertionError):
    """Failure of the machine to give a result; the text says how far it came."""


def run_machine(parts: Parts, ramdisk: Path, console: Path, limit_s: float) -> int:
    """Boot, print each line of the test program, and return its exit code.

    The kernel's own messages go to the file `console`. MachineError when there is no exit code after `limit_s`.
    """
    command = [
        str(parts.qemu),
        *("-nodefaults", "-no-user-config", "-no-reboot", "-display", "none", "-accel", "tcg"),
        *("-machine", "pc", "-cpu", "max", "-smp", "1", "-m", "1024"),
        *(("-L", str(parts.firmware / "qemu"), "-L", str(parts.firmware / "seabios")) if parts.firmware else ()),
        *("-kernel", str(parts.kernel), "-initrd", str(ramdisk)),
        *("-append", "console=ttyS0 panic=-1 loglevel=7 mitigations=off tsc=reliable random.trust_cpu=on"),
        *("-serial", f"file:{console}", "-serial", "stdio"),
        *("-fsdev", "local,id=host,path=/,security_model=none,readonly=on,multidevs=remap"),
        *("-device", "virtio-9p-pci,fsdev=host,mount_tag=host"),
    ]
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=os.environ | parts.qemu_environment,
    ) as machine:
        try:
            return follow(machine, limit_s, lambda line: print(line, flush=True))
        finally:
            machine.kill()


def follow(machine: "subprocess.Popen[bytes]", limit_s: float, say: Callable[[str], None]) -> int:
    """Pass each line to `say` until the one with the exit code; return that code."""
    stream = machine.stdout
    assert stream is not None
    end_s = time.monotonic() + limit_s
    unfinished = b""
    with selectors.DefaultSelector() as selector:
        selector.register(stream, selectors.EVENT_READ)
        while (left_s := end_s - time.monotonic()) > 0.0 and selector.select(left_s):
            chunk = os.read(stream.fileno(), 65536)
            if not chunk:
                raise MachineError(f"the machine ended with code {machine.wait()} and without a result")
            *lines, unfinished = (unfinished + chunk).split(b"\n")
            for line in (raw.decode(errors="replace").rstrip("\r") for raw in lines):
                if line.startswith(RESULT_MARK):
                    return int(line.removeprefix(RESULT_MARK))
                say(line)
    raise MachineError(f"no result within {limit_s:g} s")
