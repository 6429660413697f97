"""The process that draws: `python -m operator_side.terminal_view.main FD`, started by TerminalStatus alone.

A process apart may wait for the terminal as long as that takes; facts that came meanwhile are passed over. It ends,
and puts the terminal back, when the other end of the channel does, however that ended.
"""

import io
import select
import sys
import termios
from typing import Final

import msgspec
from rich.console import Console
from rich.live import Live

from common.clock import MonotonicClock
from common.companion.channel import Channel
from common.companion.process import companion_channel
from operator_side.facts import OperatorFacts
from operator_side.terminal_view.screen import Screen
from operator_side.terminal_view.terminal import put_back, take_over

_PERIOD_S: Final = 0.1


def main() -> None:
    """Draw until the channel ends."""
    channel, _ = companion_channel(sys.argv[1:])
    terminal = sys.stdout.fileno()
    before = termios.tcgetattr(terminal)
    try:
        take_over(terminal)
        with Live(
            console=Console(file=io.TextIOWrapper(sys.stdout.buffer, "utf-8")), screen=True, auto_refresh=False
        ) as live:
            _draw_on(channel, live)
    except OSError:
        pass  # the terminal is gone, and the program that started us gets its own signal
    finally:
        put_back(terminal, before)
        channel.close()


def _draw_on(channel: Channel, live: Live) -> None:
    clock, decoder = MonotonicClock(), msgspec.msgpack.Decoder(OperatorFacts | str)
    screen, came_s, next_s = Screen(), clock.now(), clock.now()
    while not channel.ended:
        select.select([channel], [], [], max(0.0, next_s - clock.now()))
        for message in channel.receive():
            if isinstance(said := decoder.decode(message), str):
                screen.notes.append(said)
            else:
                screen.add(said)
                came_s = clock.now()
        if (now_s := clock.now()) >= next_s:
            next_s = now_s + _PERIOD_S
            width, height = live.console.size
            live.update(screen.lines(now_s - came_s, width, height), refresh=True)


if __name__ == "__main__":
    main()
