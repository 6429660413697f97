"""Program that runs inside the virtual machine, and records how netem delays and loses messages."""

import csv
import ctypes
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.netem.cases import CASES, PATH_CASE
from tests.netem.exchanges import Recording, exchange_datagrams, exchange_stream
from tests.netem.namespaces import join_namespaces, set_netem

_FINIT_MODULE = 313
"""Number of the system call finit_module on x86_64, used because insmod may not be installed"""


def main(folder: Path, modules: Sequence[str], names: Sequence[str]) -> int:
    """Load the kernel's modules, and record each of the cases `names` into a file in `folder`."""
    for module in modules:
        _load(module)
    join_namespaces()
    for case in (PATH_CASE, *CASES):
        if case.name not in names:
            continue
        set_netem(case.netem)
        exchange = exchange_datagrams if case.model == "datagram" else exchange_stream
        _write(folder / case.file, exchange(case.messages))
        print(f"recorded {case.name}: {case.messages} messages, {case.netem}")
    return 0


def _load(module: str) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    with Path(module).open("rb") as file:
        if libc.syscall(_FINIT_MODULE, file.fileno(), b"", 0) != 0:
            raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), module)


def _write(path: Path, recording: Recording) -> None:
    start_ns = recording[0][0]
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["seq", "sent_ns", "delay_ns"])
        for number, (sent_ns, arrived_ns) in enumerate(recording):
            writer.writerow([number, sent_ns - start_ns, "" if arrived_ns is None else arrived_ns - sent_ns])


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2].split(","), sys.argv[3:]))
