"""Stand-in for /proc, with processes and their open files."""

import os
from pathlib import Path


def add_process(proc: Path, pid: int, name: str, files: dict[str, int], parent: int = 1) -> None:
    """Add the process `pid` with its open files: path by path, the flags of their opening."""
    process = proc / str(pid)
    for folder in ("fd", "fdinfo"):
        (process / folder).mkdir(parents=True)
    (process / "comm").write_text(f"{name}\n")
    (process / "status").write_text(f"Name:\t{name}\nPPid:\t{parent}\n")
    for number, (path, flags) in enumerate(files.items()):
        (process / "fd" / str(number)).symlink_to(path)
        (process / "fdinfo" / str(number)).write_text(
            f"pos:\t0\nflags:\t{flags | os.O_CLOEXEC:#o}\n".replace("0o", "0")
        )
