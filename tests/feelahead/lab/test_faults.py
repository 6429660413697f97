"""Every row of the table of faults holds, and with the guard that it is about disabled, it no longer does."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
import pytest

from common.protocol.link_end import Arrival, LinkEnd
from common.protocol.messages import AnyMessage
from common.protocol.session import SessionEvent
from feelahead.lab.faults import session, stream
from feelahead.lab.faults.fault import FAULTS
from robot_side.drivers.mujoco.joint_reference import JointReference
from robot_side.operators.lease import Lease
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Permission, Safety

pytestmark = pytest.mark.long

ROWS = (session, stream)
"""Modules whose rows are registered by being imported."""

Patch = Callable[[pytest.MonkeyPatch], None]


def put(owner: Any, name: str, value: Any) -> Patch:
    return lambda patch: patch.setattr(owner, name, value)


def nothing(*_: Any, **__: Any) -> None:
    return None


def always_fresh(patch: pytest.MonkeyPatch) -> None:
    arrived = LinkEnd.arrived

    def fresh(self: LinkEnd, message: AnyMessage, now_s: float) -> Arrival:
        return replace(arrived(self, message, now_s), fresh=True)

    patch.setattr(LinkEnd, "arrived", fresh)


def valid_for_ever(patch: pytest.MonkeyPatch) -> None:
    command = JointReference.command
    patch.setattr(JointReference, "command", lambda self, velocity, _: command(self, velocity, 1e9))


def valid_for_half(patch: pytest.MonkeyPatch) -> None:
    permission = Safety.permission

    def shorter(self: Safety, now_s: float) -> Permission:
        found = permission(self, now_s)
        return found._replace(valid_until_s=found.valid_until_s - self.settings.gap_s / 2)

    patch.setattr(Safety, "permission", shorter)


def forget_the_stop(patch: pytest.MonkeyPatch) -> None:
    end = Safety.end

    def ended(self: Safety, event: SessionEvent, now_s: float) -> None:
        end(self, event, now_s)
        self._stopped = False

    patch.setattr(Safety, "end", ended)


def gap_by_the_wall_clock(patch: pytest.MonkeyPatch) -> None:
    seen_s = [time.time()]

    def check(self: Safety, now_s: float) -> None:
        wall_s, seen_s[0] = time.time() - seen_s[0], time.time()
        if wall_s > 60.0:
            self._handle(SessionEvent.GAP, now_s)

    patch.setattr(Safety, "_check_gap", check)


def old_by_delay(_: Safety, arrival: Arrival) -> bool:
    return arrival.one_way_s is None or arrival.one_way_s > 0.18


GUARDS: tuple[tuple[str, Patch], ...] = (
    ("stream stops", put(Safety, "_check_gap", nothing)),
    ("nobody ticks", valid_for_ever),
    ("gap shorter than T", valid_for_half),
    ("backlog after a pause", put(Safety, "_queued_too_long", lambda *_: False)),
    ("robot side stopped and resumed", put(Safety, "_check_gap", nothing)),
    ("replay, duplicate, reorder", always_fresh),
    ("steady 500 ms each way", put(Safety, "_queued_too_long", old_by_delay)),
    ("answers no longer arrive", put(Safety, "_check_loop", nothing)),
    ("operator restarts", put(Lease, "has_ended", lambda *_: False)),
    ("two operators", put(OperatorSession, "_may_command", lambda *_: True)),
    ("wall clock jumps an hour", gap_by_the_wall_clock),
    ("NaN, inf, wrong size, out of range", lambda patch: patch.setattr("common.protocol.messages._in_range", nothing)),
    ("emergency stop", forget_the_stop),
    ("reconnect storm, 50/s", lambda patch: patch.setattr("robot_side.operators.lease.MOST_OBSERVERS", 10_000)),
)


@pytest.mark.parametrize(("row", "disable"), GUARDS, ids=[name for name, _ in GUARDS])
def test_without_its_guard_the_row_fails(row: str, disable: Patch, monkeypatch: pytest.MonkeyPatch) -> None:
    disable(monkeypatch)
    try:
        outcome = FAULTS[row]()
    except (RuntimeError, ValueError, msgspec.ValidationError):
        return  # it got so far astray that the row's own steps could not be taken
    assert not outcome.safe, outcome.measured


@pytest.mark.parametrize("row", FAULTS)
def test_the_row_holds_and_has_a_guard(row: str) -> None:
    assert row in dict(GUARDS)
    outcome = FAULTS[row]()
    assert outcome.safe, outcome.measured
