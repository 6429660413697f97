import sys
from collections.abc import Callable

import pytest

from tests.operator_side.terminal_view.on_terminal import OnTerminal

pytestmark = pytest.mark.processes


def test_the_demo_is_drawn_from_the_facts_of_both_sides_and_gives_the_terminal_back() -> None:
    demo = OnTerminal([sys.executable, "-P", "-m", "feelahead", "demo", "--tui", "--no-console", "--duration", "600"])
    try:
        # The delay and the zones are the operator side's, the nearest thing and the ticks the robot side's.
        for said in (b"starting", b"link ", b" mean ", b"R2 advances", b"nearest ", b"tick p99", b"ARMED"):
            demo.read_until(_shows(said))
        assert demo.end(b"contacts with obstacles") == 0
        assert demo.is_put_back()
        # The report is what stays on the first screen.
        assert b"feelahead demo: delay: " in demo.seen.rpartition(b"\x1b[?1049l")[2]
    finally:
        demo.close()


def _shows(said: bytes) -> Callable[[bytes], bool]:
    return lambda seen: said in seen
