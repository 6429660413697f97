"""Compilation of kernels in several processes, because Numba compiles in one thread only.

The helper processes store the machine code on disk, where this process finds it.
"""

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
"""Maximum number of helper processes. With more, half of the work would be done twice; each takes 0.4 GB of memory."""


class KernelQueue:
    """Queue of kernels for several processes, largest first.

    Each process takes its next kernel when it is free, so that all processes end at about the same time. A function
    that several kernels call is compiled once in each process that needs it. So a kernel's size for one process is the
    bytecode of its functions, without those that only other processes have taken.
    """

    def __init__(self, kernels: Sequence[Compiled], processes: int) -> None:
        self._sizes = {kernel: code_sizes(kernel.function) for kernel in kernels}
        self._has: list[set[FunctionType]] = [set() for _ in range(processes)]

    def take(self, process: int) -> Compiled | None:
        """Remove and return the next kernel for the process with the number `process`; None if the queue is empty."""
        if not self._sizes:
            return None
        elsewhere = set[FunctionType]().union(*self._has) - self._has[process]

        def own_size(kernel: Compiled) -> int:
            return sum(size for part, size in self._sizes[kernel].items() if part not in elsewhere)

        taken = max(self._sizes, key=own_size)
        self._has[process] |= self._sizes.pop(taken).keys()
        return taken


def compile_in_helpers(kernels: Sequence[Compiled], count: int, done: Callable[[str], None] = lambda _: None) -> None:
    """Compile kernels of our modules in `count` processes, at most 4; call `done` with each compiled kernel's name.

    If a process is killed or the disk is full, some kernels are missing afterwards. `Compiled.prepare` compiles them.
    """
    count = min(count, _MOST_PROCESSES, len(kernels))
    waiting = KernelQueue(kernels, count)
    with ExitStack() as processes:
        channels = [processes.enter_context(Companion(__name__)).channel for _ in range(count)]
        for channel in channels:
            # Close all channels before waiting: a process may take two seconds to end.
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
    """Receive kernels' names from the owner process. When it ends, end this process at once, even in a compilation."""
    while not owner.ended:
        select.select([owner], [], [])
        with speaking:
            for name in owner.receive():
                names.put(name.decode())
    os._exit(0)


def main() -> None:
    """Run a helper process: compile each kernel whose name is received. End if machine code cannot be stored."""
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
