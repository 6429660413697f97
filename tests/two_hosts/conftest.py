"""Both hosts, set up by the commands of the guide, for all tests of this folder."""

import signal
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.helpers.machines.two_machines import two_machines
from tests.two_hosts.guide import follow
from tests.two_hosts.lan import Lan, is_armed


@pytest.fixture(scope="session")
def guided() -> Iterator[Lan]:
    """LAN with both sides running and armed, after the guide's commands."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with two_machines() as machines, tempfile.TemporaryDirectory(prefix="feelahead-hosts-") as folder:
        lan = Lan(*machines, Path(folder))
        try:
            follow(lan)
            lan.start("robot")
            lan.until("robot", "it listens", bool)
            lan.start("operator")
            lan.until("operator", "the link is up", lambda status: status["link"] == "up")
            lan.until("operator", "armed", is_armed)
            yield lan
        finally:
            lan.end_all()


@pytest.fixture
def lan(guided: Lan, request: pytest.FixtureRequest) -> Lan:
    """The LAN of `guided`. After a failed test, the network is restored and both sides restart before the next test."""
    if request.session.testsfailed > guided.mended:
        guided.mended = request.session.testsfailed
        guided.mend()
    return guided
