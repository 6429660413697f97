"""Log of a peer's own positions, and the orders that a test writes to its standard input."""

import sys
import threading
import time
from collections.abc import Callable, Sequence
from typing import TextIO


def log_positions(path: str, positions: Callable[[], Sequence[float]], period_s: float = 0.01) -> None:
    """Append a line with the time and the joints' positions each `period_s`, in a thread; the clock is monotonic.

    No line is written while there are no positions.
    """

    def write(log: TextIO) -> None:
        while True:
            if here := positions():
                values = ",".join(f"{value:.6f}" for value in here)
                log.write(f"{time.monotonic():.4f},{values}\n")
            time.sleep(period_s)

    threading.Thread(target=write, args=(open(path, "w", buffering=1, encoding="ascii"),), daemon=True).start()  # noqa: SIM115, PTH123  # as long as the process


def hear_orders(obey: Callable[[list[str]], None]) -> None:
    """Call `obey` with the words of each line of the standard input, in a thread."""

    def read() -> None:
        for line in sys.stdin:
            obey(line.split())

    threading.Thread(target=read, daemon=True).start()
