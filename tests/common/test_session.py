"""Table of the session's states: what must hold in each state, and docs/session.md, which shows the same table."""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.session import OWNING, TABLE, TRANSITIONS, Session, SessionEvent, SessionState
from tests.helpers.repository import ROOT

CHANGING = [row for row in TRANSITIONS if row.after is not row.before]
WAYS_IN = (SessionEvent.ASKED_WHILE_FREE, SessionEvent.LEASE_PASSED)
STOPPING = (
    SessionEvent.GAP,
    SessionEvent.OLD_LOOP,
    SessionEvent.ARM_LOST,
    SessionEvent.ASTRAY,
    SessionEvent.EMERGENCY_STOP,
    SessionEvent.HAND_OVER,
    SessionEvent.SILENT,
    SessionEvent.NEW_EPOCH,
)


def after(state: SessionState, event: SessionEvent) -> SessionState:
    session = Session()
    session.state = state
    session.handle(event)
    return session.state


def test_each_state_and_event_has_one_row_at_most() -> None:
    assert len(TABLE) == len(TRANSITIONS)


def test_every_state_can_be_reached_and_left() -> None:
    assert {row.after for row in CHANGING} == set(SessionState) - {SessionState.UNKNOWN}
    assert {row.before for row in CHANGING} == set(SessionState) - {SessionState.ENDED}


def test_every_event_is_in_the_table() -> None:
    assert {row.event for row in TRANSITIONS} == set(SessionEvent)


def test_only_the_arming_button_arms_and_only_after_a_healthy_second() -> None:
    into = {(row.before, row.event) for row in CHANGING if row.after is SessionState.ARMED}
    ready = (SessionState.READY, SessionState.STOPPED_READY)
    assert into == {(state, SessionEvent.ARM) for state in ready}
    assert {row.event for row in CHANGING if row.after in ready} == {SessionEvent.HEALTHY}


def test_every_lease_begins_disarmed() -> None:
    for row in TRANSITIONS:
        if row.before not in OWNING and row.after in OWNING:
            assert row.after is SessionState.DISARMED
            assert row.event in WAYS_IN


def test_a_stop_ends_by_arming_alone() -> None:
    stopped = {SessionState.STOPPED, SessionState.STOPPED_READY}
    ways_out = {row.event for row in TRANSITIONS if row.before in stopped and row.after in OWNING - stopped}
    assert ways_out == {SessionEvent.ARM}


@pytest.mark.parametrize("event", SessionEvent)
def test_effect_of_each_event_on_arming_ownership_and_ended_epochs(event: SessionEvent) -> None:
    if event in STOPPING:
        assert after(SessionState.ARMED, event) is not SessionState.ARMED
    if event is SessionEvent.EMERGENCY_STOP:
        assert {after(state, event) for state in OWNING} == {SessionState.STOPPED}
    assert after(SessionState.ENDED, event) is SessionState.ENDED


towards_armed = st.sampled_from([SessionEvent.ASKED_WHILE_FREE, SessionEvent.HEALTHY, SessionEvent.ARM])


@given(st.lists(towards_armed | st.sampled_from(SessionEvent), max_size=40))
@settings(max_examples=300)
def test_armed_always_follows_a_lease_a_healthy_second_and_the_button(events: list[SessionEvent]) -> None:
    session = Session()
    since_lease: list[SessionEvent] = []
    for event in events:
        session.handle(event)
        if session.owns:
            since_lease.append(event)
        else:
            since_lease = []
        if session.state is SessionState.ARMED:
            assert since_lease[0] in WAYS_IN
            last_arm = len(since_lease) - 1 - since_lease[::-1].index(SessionEvent.ARM)
            assert SessionEvent.HEALTHY in since_lease[:last_arm]
            assert not set(since_lease[last_arm:]) & set(STOPPING)


def test_the_document_shows_every_row_in_its_table_and_its_diagram() -> None:
    text = (ROOT / "docs" / "session.md").read_text(encoding="utf-8")
    rows = {
        f"| {row.before.value} | {row.event.value} | "
        f"{'stays' if row.after is row.before else row.after.value} | {row.why} |"
        for row in TRANSITIONS
    }
    assert {line for line in text.splitlines() if re.match(r"\| (?!state |-)", line)} == rows
    arrows = {
        (before, event, after)
        for before, after, events in re.findall(r"(\w+) --> (\w+): (.*)", text)
        for event in events.split(" / ")
    }
    # A lease is a box: an arrow to the box leads to `disarmed`, one from it holds for every state in it.
    drawn = {
        (one, event, "disarmed" if after == "owner" else after)
        for before, event, after in arrows
        for one in (OWNING if before == "owner" else [before])
    }
    assert drawn == {(row.before.value, row.event.value, row.after.value) for row in CHANGING}
