"""Search for other programs that hold the controller open for writing: two writers overwrite each other's effects.

Linux shows the open files of a person's own processes, not those of others, in /proc.
"""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

PROC: Final = Path("/proc")
PERIOD_S: Final = 10.0
"""Seconds from the end of a search to the next one"""
_FILES_EACH: Final = 8
"""Number of processes and open files examined in a turn of the loop, some 10 us each"""
REMEDY: Final = (
    "its effects and these overwrite each other: close it, or, if it is Steam, switch off Steam Input for PlayStation"
    " controllers in its settings under Controller"
)


def search_writers(path: bytes, proc: Path = PROC) -> Iterator[str | None]:
    """Yield "NAME (PID)" of each other process that holds the device node `path` open for writing.

    Between these it yields None for each process and open file, so that a loop can search a little in each turn. This
    process and its children, such as its watchdog, do not count.
    """
    node = os.path.realpath(os.fsdecode(path))
    for process in filter(str.isdecimal, _listed(proc)):
        yield None
        if int(process) != os.getpid():
            for file in _listed(proc / process / "fd"):
                yield None
                if _writes(proc / process, file, node) and _parent(proc / process) != os.getpid():
                    yield f"{_read(proc / process / 'comm').strip() or 'a program'} ({process})"
                    break


def writers_of(path: bytes, proc: Path = PROC) -> list[str]:
    """Return all that `search_writers` yields."""
    return [found for found in search_writers(path, proc) if found is not None]


class SecondWriters:
    """Search for second writers of the controller in use, a little in each turn, again and again."""

    def __init__(self, proc: Path = PROC) -> None:
        self._proc = proc
        self._path: bytes | None = None
        self._search: Iterator[str | None] = iter(())
        self._next_s = 0.0
        self._said: set[str] = set()

    def look(self, path: bytes | None, now_s: float) -> list[str]:
        """Search a little more; return notes about writers that were not reported before. path: None for no node."""
        if path != self._path:
            self._path, self._next_s, self._said = path, now_s, set()
            self._search = iter(()) if path is None else search_writers(path, self._proc)
        if path is None or now_s < self._next_s:
            return []
        notes = []
        for _ in range(_FILES_EACH):
            try:
                found = next(self._search)
            except StopIteration:
                self._search, self._next_s = search_writers(path, self._proc), now_s + PERIOD_S
                break
            if found is not None and found not in self._said:
                self._said.add(found)
                notes.append(f"{found} holds the controller open for writing, too: {REMEDY}")
        return notes


def _listed(folder: Path) -> list[str]:
    try:
        return [entry.name for entry in folder.iterdir()]
    except OSError:  # the process has ended, is another person's, or this is not Linux
        return []


def _writes(process: Path, file: str, node: str) -> bool:
    try:
        if os.readlink(process / "fd" / file) != node:  # noqa: PTH115  # four times as fast as Path.readlink
            return False
    except OSError:
        return False
    flags = [line.split()[1] for line in _read(process / "fdinfo" / file).splitlines() if line.startswith("flags:")]
    return bool(flags) and int(flags[0], 8) & os.O_ACCMODE != os.O_RDONLY


def _parent(process: Path) -> int:
    found = [line.split()[1] for line in _read(process / "status").splitlines() if line.startswith("PPid:")]
    return int(found[0]) if found else 0


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
