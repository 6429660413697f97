"""The process that draws: `python -m operator_side.terminal_view.main FD`, started by TerminalStatus alone.

It waits for the terminal as long as that takes, which is why it is a process of its own; facts that came meanwhile are
passed over. It ends, and puts the terminal back, when the other end of the channel does, however that ended.
"""

import os
import select
import sys
from collections import deque
from typing import Final

import msgspec

from common.clock import MonotonicClock
from common.companion.channel import Channel
from common.companion.process import companion_channel
from operator_side.terminal_view.history import History
from operator_side.terminal_view.messages import NewFacts, Said
from operator_side.terminal_view.painting import Painter
from operator_side.terminal_view.screen import Moment, screen
from operator_side.terminal_view.signs import signs_for
from operator_side.terminal_view.terminal import attributes_of, enter, leave

_PERIOD_S: Final = 0.1
_NOTES_KEPT: Final = 100
_LOCALE: Final = ("LC_ALL", "LC_CTYPE", "LANG")


def main() -> None:
    """Draw until the channel ends."""
    channel, _ = companion_channel(sys.argv[1:])
    terminal = sys.stdout.fileno()
    before = attributes_of(terminal)
    try:
        enter(terminal)
        _draw_on(channel, terminal)
    except OSError:
        pass  # the terminal is gone, and whoever started us gets its own signal
    finally:
        leave(terminal, before)
        channel.close()


def _draw_on(channel: Channel, terminal: int) -> None:
    clock, decoder = MonotonicClock(), msgspec.msgpack.Decoder(Said)
    signs = signs_for(sys.stdout.encoding, [os.environ.get(name) for name in _LOCALE])
    painter, moment, came_s = Painter(sys.stdout), Moment(None, 0.0, History(), deque(maxlen=_NOTES_KEPT)), clock.now()
    next_s = clock.now()
    while not channel.ended:
        select.select([channel], [], [], max(0.0, next_s - clock.now()))
        for message in channel.receive():
            said = decoder.decode(message)
            if isinstance(said, NewFacts):
                moment, came_s = moment._replace(facts=said.facts), clock.now()
                moment.history.add(said.facts)
            else:
                moment.notes.append(said.text)
        now_s = clock.now()
        if now_s < next_s:
            continue
        next_s = now_s + _PERIOD_S
        columns, rows = os.get_terminal_size(terminal)
        # The last column stays free: some terminals go on in the next line as soon as it is written to.
        lines = screen(moment._replace(age_s=now_s - came_s), signs, max(1, columns - 1), max(1, rows))
        text = painter.paint(lines, columns).encode(sys.stdout.encoding, "replace")
        while text:
            text = text[os.write(terminal, text) :]


if __name__ == "__main__":
    main()
