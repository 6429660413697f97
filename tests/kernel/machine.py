"""The virtual machine: QEMU in software, the host's root over 9p, and two serial lines."""

import os
import selectors
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from tests.kernel.packages import Parts
from tests.kernel.ramdisk import RESULT_MARK


class MachineError(Exception):
    """The machine did not come to a result; the text says how far it came."""


def run_machine(
    parts: Parts, ramdisk: Path, console: Path, limit_s: float, say: Callable[[str], None], processors: int = 1
) -> int:
    """Boot, pass each line of the test program to `say`, and return its exit code.

    The kernel's own messages go to the file `console`. MachineError when there is no exit code after `limit_s`.
    """
    command = [
        str(parts.qemu),
        *("-nodefaults", "-no-user-config", "-no-reboot", "-display", "none", "-accel", "tcg"),
        *("-machine", "pc", "-cpu", "max", "-smp", str(processors), "-m", "1024"),
        *(("-L", str(parts.firmware / "qemu"), "-L", str(parts.firmware / "seabios")) if parts.firmware else ()),
        *("-kernel", str(parts.kernel), "-initrd", str(ramdisk)),
        *("-append", "console=ttyS0 panic=-1 loglevel=7 mitigations=off tsc=reliable random.trust_cpu=on"),
        *("-serial", f"file:{console}", "-serial", "stdio"),
        *("-fsdev", "local,id=host,path=/,security_model=none,readonly=on,multidevs=remap"),
        *("-device", "virtio-9p-pci,fsdev=host,mount_tag=host"),
    ]
    machine = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=os.environ | parts.qemu_environment,
    )
    try:
        code = follow(machine, limit_s, say)
        machine.wait(timeout=20.0)
    except subprocess.TimeoutExpired:
        pass  # it has said its result
    finally:
        machine.kill()
        machine.wait()
        if machine.stdout is not None:
            machine.stdout.close()
    return code


def follow(machine: "subprocess.Popen[bytes]", limit_s: float, say: Callable[[str], None]) -> int:
    """Pass each line to `say` until the one with the exit code, and return that."""
    stream = machine.stdout
    assert stream is not None
    end_s = time.monotonic() + limit_s
    unfinished = b""
    with selectors.DefaultSelector() as selector:
        selector.register(stream, selectors.EVENT_READ)
        while (left_s := end_s - time.monotonic()) > 0.0:
            if not selector.select(left_s):
                break
            chunk = os.read(stream.fileno(), 65536)
            if not chunk:
                raise MachineError(f"the machine ended with code {machine.wait()} and without a result")
            *lines, unfinished = (unfinished + chunk).split(b"\n")
            for line in (raw.decode(errors="replace").rstrip("\r") for raw in lines):
                if line.startswith(RESULT_MARK):
                    return int(line.removeprefix(RESULT_MARK))
                say(line)
    raise MachineError(f"no result within {limit_s:g} s")
