from collections import deque
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.cells import cell_len

from common.command.live_view import Value
from operator_side.facts import DelayFacts, OperatorFacts, TriggerFacts
from operator_side.terminal_view.history import History
from operator_side.terminal_view.lines import Line, Look
from operator_side.terminal_view.screen import SILENT_AFTER_S, Moment, screen
from operator_side.terminal_view.signs import ASCII, BLOCKS, Signs, signs_for
from tests.operator_side.terminal_view.made_up_facts import PULLED, STATUS, facts_in_motion, facts_of

floats = st.floats() | st.floats(-10.0, 10.0)
unknown = st.none() | floats
words = st.text(max_size=200) | st.sampled_from(
    ["up", "lost: gone", "refused: no", "armed", "stopped", "目標 🤖", "\x1b[2J"]
)
values: st.SearchStrategy[Value] = st.none() | st.booleans() | floats | st.integers() | words
strengths = st.integers(-(2**40), 2**40) | st.integers(0, 8)
triggers = st.builds(
    TriggerFacts,
    travel=unknown,
    raw=unknown,
    zones=st.tuples(*[strengths] * 10),
    meets=strengths,
    free=floats,
    stiffness=unknown,
    needed_m=unknown,
    fast_m=st.lists(floats, max_size=8).map(tuple),
    slow_m=st.lists(floats, max_size=8).map(tuple),
)
delays = st.builds(DelayFacts, asked=words, mean_ms=unknown, p99_ms=unknown, newest_ms=unknown)
any_facts = st.builds(
    OperatorFacts,
    now_s=floats,
    offset_s=unknown,
    status=st.fixed_dictionaries({}, optional=dict.fromkeys([*STATUS, "other"], values)),
    l2=triggers,
    r2=triggers,
    rumble=floats,
    advancing=words,
    to_operator=delays,
    to_robot=delays,
    round_trip_ms=unknown,
    field_age_ms=unknown,
    hands=words,
    may_tune=st.booleans(),
    probability=unknown,
)


def drawn(
    facts: OperatorFacts | None,
    width: int = 79,
    height: int = 24,
    *,
    signs: Signs = BLOCKS,
    age_s: float = 0.0,
    notes: tuple[str, ...] = (),
) -> list[str]:
    history = History()
    if facts is not None:
        history.add(facts)
    return [plain(line) for line in screen(Moment(facts, age_s, history, deque(notes)), signs, width, height)]


def plain(line: Line) -> str:
    return "".join(text for text, _ in line)


@settings(max_examples=100, deadline=None)
@given(
    st.lists(any_facts, min_size=1, max_size=4),
    st.integers(60, 200),
    st.integers(20, 60),
    st.lists(words, max_size=100),
    floats,
    st.sampled_from([BLOCKS, ASCII]),
)
def test_whatever_is_known_fits_whatever_room_there_is(
    facts: list[OperatorFacts], width: int, height: int, notes: list[str], age_s: float, signs: Signs
) -> None:
    history = History()
    for each in facts:
        history.add(each)
    lines = [plain(line) for line in screen(Moment(facts[-1], age_s, history, deque(notes)), signs, width, height)]
    assert [cell_len(line) for line in lines] == [width] * height
    assert all(line.isprintable() for line in lines)
    if signs.plain:
        assert all(line.isascii() for line in lines)


@pytest.mark.parametrize("size", [(1, 1), (10, 3), (79, 1), (500, 200)])
def test_odd_sizes_are_filled_too(size: tuple[int, int]) -> None:
    width, height = size
    for facts in (None, facts_of()):
        assert [cell_len(line) for line in drawn(facts, width, height)] == [width] * height


def test_everything_is_on_a_screen_of_the_usual_size() -> None:
    text = "\n".join(drawn(facts_of(), notes=("listening at tcp://127.0.0.1:5555",)))
    for said in (
        ">>> ARMED  approaching >>>",
        "link up",
        "lease armed",
        "hands person",
        "mean  52.1  p99  61.0  now  50.4 ms",
        "asked: delay 50ms 10ms",
        "round trip 104 ms",
        "field age 0.90 ms",
        "R2 advances   40 %, free 35 %",
        "L2 retreats    0 %, free 100 %",
        ".  .  .  1  2  4  6  8  8  8",
        "meets  2 of 8  stiffness 0.31",
        "52 mm ahead",
        "31 36 41 47 52 58 63 69 mm",
        "44 49 54 60 65 71 76 82 mm",
        "nearest bottle at 34 mm",
        "target mug at 120 mm",
        "holding nothing",
        "P 0.99",
        "140 of 140 µs",
        "listening at tcp://127.0.0.1:5555",
    ):
        assert said in text
    assert [name for name in ("delay", "stiffness", "overlap", "tick p99") if f"\n{name}" not in text] == []


STATES: dict[str, dict[str, Any]] = {
    ">>> ARMED  approaching >>>": {},
    "--- DISARMED  ready to arm ---": {"state": "disarmed", "owner": "ready", "person": None},
    "!!! STOPPED: emergency stop !!!": {"state": "stopped", "stopped_because": "emergency stop"},
    "!!! LINK LOST: nothing heard from the robot !!!": {"link": "lost: nothing heard from the robot", "state": None},
    "!!! CONTROLLER LOST !!!": {"controller": "lost"},
    "!!! RELEASE BOTH TRIGGERS !!!": {"release_first": True},
    "... waiting for the robot side ...": {"link": "waiting for the robot side", "state": None},
}


@pytest.mark.parametrize("signs", [BLOCKS, ASCII])
@pytest.mark.parametrize(("banner", "status"), STATES.items())
def test_each_state_has_words_and_signs_of_its_own(banner: str, status: dict[str, Value], signs: Signs) -> None:
    shown = drawn(facts_of(1.0, PULLED, **status), signs=signs)[0]
    assert shown.startswith(banner)
    # An alarm is told from all else by its line's end alone.
    assert (shown[-1] == "!") == banner.startswith("!")


def test_what_nobody_has_renewed_is_said_to_be_old() -> None:
    assert drawn(facts_of(), age_s=SILENT_AFTER_S)[0].startswith(">>> ARMED")
    assert drawn(facts_of(), age_s=3.21)[0].startswith("!!! NO NEWS for 3.2 s !!!")
    assert drawn(None, age_s=60.0)[0].startswith("... starting ...")


def test_the_finger_stands_where_the_zones_are() -> None:
    # 255 is reported at three quarters of the mechanical travel, along which the ten zones lie.
    half = msgspec.structs.replace(facts_of().r2, raw=2.0 / 3.0)
    shown = drawn(facts_of(r2=half), signs=ASCII)
    (finger,) = (line for line in shown if line.startswith("finger"))
    right = finger[40 + len("finger ") :].rstrip()
    assert right.index("|") == pytest.approx(len(right) / 2, abs=1)


def test_more_room_shows_more_and_never_less() -> None:
    history = History()
    for tick in range(300):
        history.add(facts_in_motion(0.1 * tick))
    notes = deque(f"note {number}" for number in range(40))
    before: set[str] = set()
    for height in (20, 24, 30, 36, 48, 60):
        lines = screen(Moment(facts_in_motion(30.0), 0.0, history, notes), BLOCKS, 120, height)
        shown = {word for line in lines for word in plain(line).split() if word.isascii() and len(word) > 1}
        assert before <= shown
        before = shown
    assert "28" in before


def test_colour_only_underlines() -> None:
    # What is coloured differs in words as well: every look is used for text that says the same without.
    alarm = screen(Moment(facts_of(state="stopped"), 0.0, History(), deque()), BLOCKS, 79, 24)[0]
    armed = screen(Moment(facts_of(), 0.0, History(), deque()), BLOCKS, 79, 24)[0]
    assert {look for text, look in alarm if text.strip()} == {Look.ALARM}
    assert {look for text, look in armed if text.strip()} == {Look.GOOD}
    assert plain(alarm) != plain(armed)


@pytest.mark.parametrize(
    ("encoding", "locale", "signs"),
    [
        ("utf-8", [None, None, "de_DE.UTF-8"], BLOCKS),
        ("utf-8", ["C.UTF-8", None, None], BLOCKS),
        ("utf-8", [None, "C.UTF-8", "C.UTF-8"], BLOCKS),
        # Python has set LC_CTYPE itself, as nobody chose a locale.
        ("utf-8", [None, "C.UTF-8", None], ASCII),
        ("utf-8", ["C", None, "de_DE.UTF-8"], ASCII),
        ("utf-8", [None, None, None], ASCII),
        ("iso-8859-1", [None, None, "de_DE.UTF-8"], ASCII),
    ],
)
def test_blocks_only_where_the_terminal_knows_them(encoding: str, locale: list[str | None], signs: Signs) -> None:
    assert signs_for(encoding, locale) is signs
