import os
import select
import signal

import pytest

from common.companion.process import Companion

pytestmark = pytest.mark.processes
ECHO = "tests.common.companion.echo"


def answer(companion: Companion) -> bytes:
    arrived: list[bytes] = []
    while not arrived:
        assert select.select([companion.channel], [], [], 20.0)[0]
        arrived = companion.channel.receive()
        assert not companion.channel.ended
    return arrived[0]


def test_it_answers_and_ends_with_the_channel() -> None:
    with Companion(ECHO) as companion:
        companion.channel.send(b"anybody there?")
        assert answer(companion) == b"anybody there?"
        # Ctrl-C and a closed terminal are handled by the parent, not by the companion.
        os.kill(companion.process_id, signal.SIGINT)
        os.kill(companion.process_id, signal.SIGTERM)
        companion.channel.send(b"still?")
        assert answer(companion) == b"still?"
        assert companion.close()
    assert not companion.running


def test_its_death_is_noticed() -> None:
    with Companion(ECHO) as companion:
        companion.channel.send(b"anybody there?")
        answer(companion)
        os.kill(companion.process_id, signal.SIGKILL)
        assert select.select([companion.channel], [], [], 20.0)[0]
        assert companion.channel.receive() == []
        assert companion.channel.ended
