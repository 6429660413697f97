"""Every row of the fault table that virtual time can decide, and each guard of the robot side is needed for one.

With a guard disabled, a row no longer holds.
"""

import ast
import importlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import msgspec
import pytest

import common.protocol.session
from common.errors import ConfigurationError
from common.protocol.link_end import Arrival, LinkEnd
from common.protocol.messages import AnyMessage
from common.protocol.session import SessionEvent, SessionState
from feelahead.lab.faults import session_faults, stream_faults
from feelahead.lab.faults.fault import VIRTUAL, Fault, Outcome
from feelahead.lab.questions.faults import QUESTION
from feelahead.lab.sweep import ask
from robot_side.operators.lease import Lease
from robot_side.operators.operator_session import OperatorSession
from robot_side.operators.safety import Permission, Safety
from robot_side.simulation.joint_reference import JointReference
from tests.helpers.repository import ROOT

pytestmark = pytest.mark.long

Patch = Callable[[pytest.MonkeyPatch], None]


def put(owner: Any, name: str, value: Any) -> Patch:
    """Replace an attribute of a class, or of a module given by its name."""
    place = importlib.import_module(owner) if isinstance(owner, str) else owner
    return lambda patch: patch.setattr(place, name, value)


def both(first: Patch, second: Patch) -> Patch:
    def patches(patch: pytest.MonkeyPatch) -> None:
        first(patch)
        second(patch)

    return patches


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


def leads_to(state: SessionState, event: SessionEvent, after: SessionState) -> Patch:
    """Change one row of the session's table."""
    rows: Mapping[Any, Any] = common.protocol.session.TABLE
    row = replace(rows[state, event], after=after)
    return put(common.protocol.session, "TABLE", MappingProxyType({**rows, (state, event): row}))


def any_command_of_the_owner(self: OperatorSession, participant: Any, _: Any) -> bool:
    return participant is self.lease.owner


def old_by_delay(_: Safety, arrival: Arrival) -> bool:
    return arrival.one_way_s is None or arrival.one_way_s > 0.18


@dataclass(frozen=True)
class Guard:
    name: str
    disable: Patch
    row: Callable[[], Outcome]


GUARDS = (
    Guard("the gap limit", put(Safety, "_check_gap", nothing), stream_faults.stream_stops),
    Guard("the gap limit on waking", put(Safety, "_check_gap", nothing), stream_faults.robot_stopped),
    Guard("the arm's own valid_until", valid_for_ever, stream_faults.ticks_stop),
    Guard("holding until the limit", valid_for_half, stream_faults.short_gap),
    Guard("the age limit", put(Safety, "_queued_too_long", lambda *_: False), stream_faults.backlog),
    Guard("age is not delay", put(Safety, "_queued_too_long", old_by_delay), stream_faults.steady_delay),
    Guard("epoch and sequence", always_fresh, stream_faults.replay),
    Guard("the loop's age", put(Safety, "_check_loop", nothing), stream_faults.old_loop),
    Guard("only the owner", put(OperatorSession, "_may_command", lambda *_: True), session_faults.two_operators),
    Guard(
        "the fencing token", put(OperatorSession, "_may_command", any_command_of_the_owner), session_faults.hand_over
    ),
    Guard("the end of a silent lease", put(Lease, "expire", nothing), session_faults.two_operators),
    Guard(
        "a lease begins disarmed",
        # A new owner's loop age is not known yet, which alone would disarm it again.
        both(
            leads_to(SessionState.OBSERVING, SessionEvent.LEASE_PASSED, SessionState.ARMED),
            put(Safety, "_loop_is_young", lambda *_: True),
        ),
        session_faults.hand_over,
    ),
    Guard("an epoch ends with the next", put(Lease, "end_epoch_of", nothing), session_faults.operator_restarts),
    Guard("an ended epoch stays so", put(Lease, "has_ended", lambda *_: False), session_faults.operator_restarts),
    Guard("the healthy second", put(Safety, "_healthy_for_long", lambda *_: True), session_faults.wrong_arming),
    Guard("released triggers", put("robot_side.operators.safety", "RELEASED_TRAVEL", 2.0), session_faults.wrong_arming),
    Guard("a known loop age", put(Safety, "_loop_is_young", lambda *_: True), session_faults.wrong_arming),
    Guard("the emergency stop", put(Safety, "emergency_stop", nothing), session_faults.emergency_stop),
    Guard("the latch of the stop", forget_the_stop, session_faults.emergency_stop),
    Guard("ranges of fields", put("common.protocol.messages", "_in_range", nothing), session_faults.bad_messages),
    Guard("no clock but now", gap_by_the_wall_clock, session_faults.wall_clock_jumps),
    Guard(
        "room for observers",
        put("robot_side.operators.lease", "MOST_OBSERVERS", 10_000),
        session_faults.reconnect_storm,
    ),
)


@pytest.mark.parametrize("guard", GUARDS, ids=lambda guard: guard.name)
def test_without_the_guard_the_row_fails(guard: Guard, monkeypatch: pytest.MonkeyPatch) -> None:
    guard.disable(monkeypatch)
    try:
        outcome = guard.row()
    except (RuntimeError, ValueError, msgspec.ValidationError):
        return  # it got so far astray that the row's own steps could not be taken
    assert not outcome.safe, outcome.measured


@pytest.mark.parametrize("fault", VIRTUAL.values(), ids=lambda fault: fault.run.__name__)
def test_the_row_holds(fault: Fault) -> None:
    outcome = fault.run()
    assert outcome.safe, outcome.measured


def test_nobody_reads_the_wall_clock() -> None:
    # Not by any name: a clock that jumps by an hour must not be there to trip over.
    wall_clocks = {"time.time", "time.time_ns", "time.localtime", "time.gmtime", "time.strftime", "time.ctime"}
    for package in ("common", "robot_side", "operator_side"):
        for path in (ROOT / package).rglob("*.py"):
            tree = ast.parse(path.read_text(encoding="utf-8"))
            imported = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
            imported |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module}
            assert not imported & {"datetime", "calendar"}, path
            read = {ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
            # A recording's stamps are the wall clock's: it is read once, and for these alone.
            if path == ROOT / "common" / "clock.py":
                read.discard("time.time")
            elif path.parent != ROOT / "common" / "recording":
                assert "wall_clock_offset_s" not in path.read_text(encoding="utf-8"), path
            assert not read & wall_clocks, path


def test_an_unsafe_row_is_the_answer_and_the_exit_code(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Safety, "_check_gap", nothing)
    one = VIRTUAL["stream stops"]
    monkeypatch.setattr("feelahead.lab.questions.faults.VIRTUAL", {one.name: one})
    assert ask(QUESTION, ["--only", "virtual"]) == 1
    assert "UNSAFE" in capsys.readouterr().out


def test_too_few_repetitions_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="repeats"):
        ask(QUESTION, ["--repeats", "0"])
