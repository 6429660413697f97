"""What comes next, and which event may come."""

import json
from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from feelahead.study.events import Begun, Event, Paused, Rested, Resumed, Withdrew, event_of
from feelahead.study.progress import Progress, next_step, progress_of, require_next, step_after
from feelahead.study.protocol import Protocol
from feelahead.study.records import answer_records, trial_records, withdrawn
from feelahead.study.schedule import schedule
from feelahead.study.steps import Done, Enrol, Pause, Practice, Questions, Rest, Step, Trial, Withdrawn, public
from tests.feelahead.study.driving import answer_to, begun, end_of, fault_of
from tests.feelahead.study.protocols import protocol

OF = protocol()


def _driven(of: Protocol, successes: Iterable[bool] = (), until: type = Done, participant: int = 1) -> list[Event]:
    """Return the events of a participant until a step of class `until` comes; successes: of practice, then True."""
    practised, events = iter(successes), list[Event]()
    while not isinstance(step := next_step(of, events, participant), until | Done):
        for event in _doing(step, participant, float(len(events)), practised):
            require_next(of, progress_of(events, participant), event)
            events.append(event)
    return events


def _doing(step: Step, participant: int, at_s: float, practised: Iterable[bool]) -> list[Event]:
    if isinstance(step, Practice | Trial):
        first = begun(step, participant, at_s)
        success = next(iter(practised), True) if isinstance(step, Practice) else True
        return [first, end_of(first, success)]
    answer = answer_to(step, participant, at_s)
    return [] if answer is None else [answer]


def _names(of: Protocol, events: list[Event]) -> list[str]:
    steps = [public(next_step(of, events[:count], 1)) for count in range(len(events) + 1)]
    return [step["step"] for step in steps]


def test_a_session_has_its_steps_in_their_order() -> None:
    events = _driven(OF)
    trial = ["trial", "trial"]  # An attempt that is open would be done again.
    assert _names(OF, events) == [
        *("enrol", "consent", *["practice"] * 4),
        *(*trial, *trial, "questions", *trial, "rest", *trial, "questions", "done"),
    ]


def test_without_practice_rest_and_questions_there_are_trials_alone() -> None:
    of = protocol(practice=None, rest=None, items=[])
    assert _names(of, _driven(of)) == ["enrol", "consent", *["trial"] * 8, "done"]


def test_of_a_trial_nothing_is_shown_but_its_number() -> None:
    for kind, of in ((Practice, 4), (Trial, 4)):
        step = next_step(OF, _driven(OF, until=kind), 1)
        assert public(step) == {"step": kind.__name__.lower(), "number": 1, "attempt": 1, "of": of}


@pytest.mark.parametrize(
    ("successes", "reached", "tries"),
    [
        ([True, True], True, 2),
        ([True, False, True, True], True, 4),
        ([True, False, True, False], False, 4),
        ([False, False, False, False], False, 4),
    ],
)
def test_practice_ends_by_successes_in_a_row_or_by_its_number(successes: list[bool], reached: bool, tries: int) -> None:
    progress = progress_of(_driven(OF, successes, Trial), 1)
    assert progress.practised(OF.practice) is reached
    assert len(progress.attempts) == tries
    seeds = {record.seed for record in trial_records(OF, _driven(OF, successes, Trial))}
    assert len(seeds) == tries


def test_a_fault_of_practice_is_repeated_and_breaks_no_row() -> None:
    events = _driven(OF, until=Practice)
    for fault in (False, True, False):
        step = next_step(OF, events, 1)
        assert isinstance(step, Practice)
        first = begun(step, 1, 0.0)
        events += [first, fault_of(first) if fault else end_of(first)]
    assert [(one.begun.trial, one.begun.attempt) for one in progress_of(events, 1).attempts] == [(1, 1), (2, 1), (2, 2)]
    assert isinstance(next_step(OF, events, 1), Trial)


@pytest.mark.parametrize("how", ["cut off", "failed while running", "failed after its end"])
def test_a_fault_is_repeated_marked_and_counted(how: str) -> None:
    events = _driven(OF, until=Trial)
    step = next_step(OF, events, 1)
    assert isinstance(step, Trial)
    first = begun(step, 1, 0.0)
    events += [first, *([end_of(first)] if "after" in how else []), *([fault_of(first)] if "failed" in how else [])]
    again = next_step(OF, events, 1)
    assert isinstance(again, Trial)
    assert (again.planned, again.attempt) == (step.planned, 2)
    second = begun(again, 1, 1.0)
    require_next(OF, progress_of(events, 1), second)
    events += [second, end_of(second)]
    found = [record for record in trial_records(OF, events) if not record.practice]
    reason = "interrupted" if how == "cut off" else "the phone rang"
    assert [(one.trial, one.attempt, one.status, one.excluded) for one in found] == [
        (1, 1, "fault", reason),
        (1, 2, "complete", None),
    ]
    assert [one.recording for one in found] == ["p01-t001.mcap", "p01-t001-2.mcap"]


def test_only_the_last_attempt_may_be_said_to_be_a_fault_and_only_until_something_follows() -> None:
    events = _driven(OF, until=Questions)
    last = [event for event in events if isinstance(event, Begun)][-2:]
    require_next(OF, progress_of(events, 1), fault_of(last[1]))
    for event, after in ((last[0], events), (last[1], [*events, fault_of(last[1])]), (last[1], _driven(OF))):
        with pytest.raises(ValueError, match="failed does not come now"):
            require_next(OF, progress_of(after, 1), fault_of(event))


def test_a_pause_holds_what_comes_next_and_lets_a_running_trial_end() -> None:
    events = _driven(OF, until=Trial)
    step = next_step(OF, events, 1)
    assert isinstance(step, Trial)
    first = begun(step, 1, 0.0)
    events += [first, Paused(participant=1, at_s=1.0)]
    assert next_step(OF, events, 1) == Pause()
    require_next(OF, progress_of(events, 1), end_of(first))
    events += [end_of(first), Resumed(participant=1, at_s=2.0)]
    after = next_step(OF, events, 1)
    assert isinstance(after, Trial)
    assert after.planned.number == 2


@pytest.mark.parametrize("what", ["keep", "remove"])
def test_who_withdraws_leaves_what_the_protocol_says(what: str) -> None:
    of = protocol(withdrawn=what)
    events = _driven(of, until=Rest)
    upcoming = Rested(participant=1, at_s=0.0, after=3)
    step = next_step(of, [*events, upcoming], 1)
    assert isinstance(step, Trial)
    events += [upcoming, begun(step, 1, 0.0), Withdrew(participant=1, at_s=1.0), *_driven(of, participant=2)]
    assert next_step(of, events, 1) == Withdrawn()
    assert next_step(of, events, 2) == Done()
    assert withdrawn(events) == (1,)
    found = [(one.participant, one.status) for one in trial_records(of, events) if not one.practice]
    kept = [*[(1, "complete")] * 3, (1, "withdrawn")] if what == "keep" else []
    assert found == [*kept, *[(2, "complete")] * 4]
    assert {one.participant for one in answer_records(of, events)} == ({1, 2} if what == "keep" else {2})


def test_the_tables_have_the_plan_and_the_answers() -> None:
    events = _driven(OF, participant=3)
    records = [one for one in trial_records(OF, events) if not one.practice]
    assert [
        (one.trial, one.block, one.condition, one.delay_ms, one.scene, one.repeat, one.seed) for one in records
    ] == [
        (one.number, one.block, one.condition, one.delay_ms, one.scene, one.repeat, one.seed) for one in schedule(OF, 3)
    ]
    assert {one.excluded for one in trial_records(OF, events) if one.practice} == {"practice"}
    answers = answer_records(OF, events)
    assert [(one.block, one.item, one.value) for one in answers] == [(1, "It helped.", 7.0), (2, "It helped.", 7.0)]
    assert [one.condition for one in answers] == list(dict.fromkeys(one.condition for one in records))


@given(st.data())
def test_no_page_shows_anything_that_depends_on_the_condition(data: st.DataObject) -> None:
    names = data.draw(st.permutations(["off", "felt-ahead"]))
    turned = protocol(conditions={name: {"haptics": name != "off"} for name in names})
    count = data.draw(st.integers(0, len(_driven(OF))))
    shown = [public(next_step(of, _driven(of)[:count], 1)) for of in (OF, turned)]
    assert shown[0] == shown[1]
    assert not any(name in json.dumps(shown) for name in names)


def test_an_event_that_does_not_come_next_is_refused_without_a_word_of_the_condition() -> None:
    everything = _driven(OF)
    for count in range(len(everything) + 1):
        events = everything[:count]
        progress = progress_of(events, 1)
        for event in everything:
            try:
                require_next(OF, progress, event)
            except ValueError as error:
                assert not any(name in str(error) for name in OF.conditions)  # noqa: PT017
            else:
                assert _moves(progress, event)
    with pytest.raises(ValueError, match="valid: what goes with enrol"):
        require_next(OF, Progress(), everything[1])


def _moves(progress: Progress, event: Event) -> bool:
    """Return whether an event that was accepted changes the state: none is done twice."""
    return progress.after(event) != progress


def test_events_are_json_and_one_of_a_wrong_kind_is_refused() -> None:
    assert event_of({"event": "rested", "participant": 1, "at_s": 0.5, "after": 3}) == Rested(
        participant=1, at_s=0.5, after=3
    )
    for bad in ({"event": "rested", "participant": 0, "at_s": 0.5, "after": 3}, {"event": "slept"}, {}):
        with pytest.raises(ValueError, match=r"participant|event|slept"):
            event_of(bad)


def test_participants_do_not_depend_on_each_other() -> None:
    mixed = [event for pair in zip(_driven(OF), _driven(OF, participant=2), strict=True) for event in pair]
    assert progress_of(mixed, 1) == progress_of(_driven(OF), 1)
    assert step_after(OF, progress_of(mixed, 3), 3) == Enrol()
