"""The process that renders for a robot side, as Linux tells of it."""

import contextlib
import os
from pathlib import Path

_MODULE = b"robot_side.cameras.companion"


def companion_of(process_id: int) -> int | None:
    """The number of the companion of the robot side with the number `process_id`; None while there is none."""
    for children in Path(f"/proc/{process_id}/task").glob("*/children"):
        for child in children.read_text(encoding="ascii").split():
            with contextlib.suppress(OSError):
                if _MODULE in Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0"):
                    return int(child)
    return None


def processor_s(process_id: int) -> float:
    """How long a process has kept processors busy until now; OSError where it has ended."""
    fields = Path(f"/proc/{process_id}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
