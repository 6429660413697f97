"""What the audit log says of a session, in virtual time."""

from typing import Any

import pytest

from common.peer_name import peer_name
from common.sockets.door.messages import Event
from robot_side.reporting.audit import Audit
from tests.robot_side.session_bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


class Log:
    def __init__(self) -> None:
        self.said: list[tuple[str, dict[str, Any]]] = []

    def note(self, event: str, **more: str | float) -> None:
        self.said.append((event, more))

    def take_failure(self) -> bool:
        return False


def test_who_armed_is_said_by_key_and_address_and_why_it_was_disarmed(bench: Bench) -> None:
    log, anna = Log(), peer_name("key of anna", b"one")
    audit = Audit(log)
    operator = bench.join(2, anna)
    audit.look(bench.robot.session, [])
    audit.look(bench.robot.session, [Event("connected", "anna", "10.0.0.3:5123 at --bind", anna)])
    bench.arm_it(operator)
    for _ in range(3):
        audit.look(bench.robot.session, [])
    bench.silence(2.0)
    audit.look(bench.robot.session, [])
    audit.look(bench.robot.session, [Event("left", "anna", "", anna)])
    who = {"who": "anna", "where": "10.0.0.3:5123 at --bind"}
    kinds = [kind for kind, _ in log.said]
    assert kinds == ["connected", "lease", "armed", "lease free", "disarmed", "left"]
    assert [more for kind, more in log.said if kind in ("connected", "lease", "armed")] == [who] * 3
    assert dict(log.said)["disarmed"]["why"]


def test_names_are_forgotten_when_peers_leave_and_strangers_cannot_fill_the_memory(bench: Bench) -> None:
    log = Log()
    audit = Audit(log)
    audit.look(bench.robot.session, [Event("connected", "", "", b"%d" % number) for number in range(1000)])
    assert len(audit._names) <= 256
    audit.look(bench.robot.session, [Event("left", "", "", b"%d" % number) for number in range(1000)])
    assert audit._names == {}
