"""Compiling in processes beside this one, which leave machine code on disk: Numba compiles in one thread alone."""

import os
import select
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from importlib import import_module
from queue import SimpleQueue
from types import FunctionType
from typing import Final

from common.companion.channel import Channel
from common.companion.process import Companion, companion_channel
from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.compiled.sources import code_sizes

_MOST_PROCESSES: Final = 4
"""With more, half of the work would be done twice; each takes 0.4 GB."""


class KernelQueue:
    """Kernels for several processes, the largest first: each process asks for its next, so that all end together.

    A function that several kernels call is compiled once in each process that needs it. So the size of a kernel is
    the bytecode of its functions that no other process has.
    """

    def __init__(self, kernels: Sequence[Compiled], processes: int) -> None:
        self._sizes = {kernel: code_sizes(kernel.function) for kernel in kernels}
        self._has: list[set[FunctionType]] = [set() for _ in range(processes)]

    def take(self, process: int) -> Compiled | None:
        """Take the next for a process, by its number; None when there is none left."""
        if not self._sizes:
            return None
        elsewhere = set[FunctionType]().union(*self._has) - self._has[process]

        def own_size(kernel: Compiled) -> int:
            return sum(size for part, size in self._sizes[kernel].items() if part not in elsewhere)

        taken = max(self._sizes, key=own_size)
        self._has[process] |= self._sizes.pop(taken).keys()
        return taken


def compile_beside(kernels: Sequence[Compiled], count: int, done: Callable[[str], None] = lambda _: None) -> None:
    """Compile kernels of our modules in `count` processes, 4 at most; call `done` with the name of each.

    A process may be killed, or find no room on the disk. `prepare` compiles what is missing then.
    """
    count = min(count, _MOST_PROCESSES, len(kernels))
    waiting = KernelQueue(kernels, count)
    with ExitStack() as processes:
        channels = [processes.enter_context(Companion(__name__)).channel for _ in range(count)]
        for channel in channels:
            # Before any of them is waited for: a process may take two seconds to end.
            processes.callback(channel.close)

        def hand_on(place: int) -> None:
            kernel = waiting.take(place)
            if kernel is None:
                channels[place].close()
            else:
                channels[place].send(kernel.name.encode())

        for place in range(count):
            hand_on(place)
        while running := [channel for channel in channels if not channel.ended]:
            for channel in select.select(running, [], [])[0]:
                for name in channel.receive():
                    done(name.decode())
                    hand_on(channels.index(channel))


def _listen(owner: Channel, speaking: threading.Lock, names: SimpleQueue[str]) -> None:
    """Take names of kernels from the owner, and end with it: a compilation cannot be asked to stop."""
    while not owner.ended:
        select.select([owner], [], [])
        with speaking:
            for name in owner.receive():
                names.put(name.decode())
    os._exit(0)


def main() -> None:
    """Compile each kernel whose name comes, which says its module, too; end where nothing can be kept."""
    owner, _ = companion_channel(sys.argv[1:])
    speaking, names = threading.Lock(), SimpleQueue[str]()
    threading.Thread(target=_listen, args=(owner, speaking, names), daemon=True).start()
    while True:
        name = names.get()
        import_module(name.rpartition(".")[0])
        kernel = next(kernel for kernel in imported_kernels() if kernel.name == name)
        kernel.prepare()
        if not kernel.is_kept:
            return
        with speaking:
            owner.send(name.encode())


if __name__ == "__main__":
    main()
