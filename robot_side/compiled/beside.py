"""Compiling in processes beside this one, which leave machine code on disk: Numba compiles in one thread alone."""

import os
import select
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from importlib import import_module
from types import FunctionType
from typing import Final

from common.companion.channel import Channel
from common.companion.process import Companion, companion_channel
from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.compiled.sources import code_sizes

_MOST_PROCESSES: Final = 4
"""With more, half of the work would be done twice; each takes 0.4 GB."""
_OWN: Final = 1000
"""What a kernel costs by itself: as much as so many bytes of bytecode."""


def shares(kernels: Sequence[Compiled], count: int) -> list[list[Compiled]]:
    """The kernels in at most `count` shares that take about the same time, the largest first in each.

    A function that several kernels of a share call is compiled once there.
    """
    sizes = {kernel: code_sizes(kernel.function) for kernel in kernels}
    compiled: list[dict[FunctionType, int]] = [{} for _ in range(count)]
    costs, found = [0] * count, [list[Compiled]() for _ in range(count)]
    for kernel in sorted(kernels, key=lambda kernel: -sum(sizes[kernel].values())):
        more = [_OWN + sum(size for part, size in sizes[kernel].items() if part not in there) for there in compiled]
        # What is new counts twice: else each would compile what it could leave to the one that has most of it.
        least = min(range(count), key=lambda place: costs[place] + 2 * more[place])
        costs[least] += more[least]
        compiled[least] |= sizes[kernel]
        found[least].append(kernel)
    return [share for share in found if share]


def compile_beside(kernels: Sequence[Compiled], count: int, done: Callable[[str], None] = lambda _: None) -> None:
    """Compile kernels of our modules in `count` processes, 4 at most; `done` is told the name of each.

    Nothing is promised: a process may be killed, or find no room on the disk. What is not there then, `prepare`
    compiles.
    """
    with ExitStack() as processes:
        channels = [
            processes.enter_context(Companion(__name__, [kernel.name for kernel in share])).channel
            for share in shares(kernels, min(count, _MOST_PROCESSES))
        ]
        while running := [channel for channel in channels if not channel.ended]:
            for channel in select.select(running, [], [])[0]:
                for name in channel.receive():
                    done(name.decode())


def _end_with(owner: Channel) -> None:
    """A compilation cannot be asked to stop."""
    while not owner.ended:
        select.select([owner], [], [])
        owner.receive()
    os._exit(0)


def main() -> None:
    """Compile the kernels that the arguments name, each of which says its module, too."""
    owner, names = companion_channel(sys.argv[1:])
    threading.Thread(target=_end_with, args=(owner,), daemon=True).start()
    for name in names:
        import_module(name.rpartition(".")[0])
    known = {kernel.name: kernel for kernel in imported_kernels()}
    for name in names:
        known[name].prepare()
        owner.send(name.encode())


if __name__ == "__main__":
    main()
