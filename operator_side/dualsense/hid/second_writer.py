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
_FILES_EACH: Final = 4
"""Number of processes and open files examined in a turn of the loop, some 4 us each"""
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
    own = str(os.getpid())
    for number in filter(str.isdecimal, _listed(str(proc))):
        yield None
        process = f"{proc}/{number}"
        for file in _listed(f"{process}/fd") if number != own else ():
            yield None
            if _writes(process, file, node) and _line(f"{process}/status", "PPid:") != own:
                yield f"{_read(f'{process}/comm').strip() or 'a program'} ({number})"
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

    def search(self, path: bytes | None, now_s: float) -> list[str]:
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


def _listed(folder: str) -> Iterator[str]:
    """Yield the names in a folder one by one, as a list of all would take a turn too long."""
    try:
        with os.scandir(folder) as entries:
            yield from (entry.name for entry in entries)
    except OSError:  # the process has ended, is another person's, or this is not Linux
        return


def _writes(process: str, file: str, node: str) -> bool:
    try:
        if os.readlink(f"{process}/fd/{file}") != node:  # noqa: PTH115  # a path object takes longer than the call
            return False
    except OSError:
        return False
    flags = _line(f"{process}/fdinfo/{file}", "flags:")
    return flags != "" and int(flags, 8) & os.O_ACCMODE != os.O_RDONLY


def _line(path: str, name: str) -> str:
    """Return the word after `name` in a file of /proc; "" without it."""
    return next((line.split()[1] for line in _read(path).splitlines() if line.startswith(name)), "")


def _read(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
