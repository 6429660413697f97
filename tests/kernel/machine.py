"""Virtual machine in QEMU, emulated in software. It has two serial lines, and reads the host's files over 9p."""

import os
import selectors
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from tests.kernel.packages import Parts
from tests.kernel.ramdisk import RESULT_MARK


class MachineError(AssertionError):
    """The virtual machine gave no result; the text says whether it ended or took too long."""


def run_machine(parts: Parts, ramdisk: Path, console: Path, limit_s: float) -> int:
    """Boot the virtual machine, print each line of the test program in it, and return the program's exit code.

    The kernel's own messages go to the file `console`. MachineError if no exit code has come after `limit_s`.
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
    """Pass each output line to `say`, until the line with the exit code comes; return that code."""
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
