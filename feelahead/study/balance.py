"""How balanced the plans of a study's participants are, and how long each takes at most."""

from collections import Counter
from collections.abc import Container, Iterable, Mapping
from itertools import pairwise, product
from typing import Final

from feelahead.study.events import MOST_NUMBER
from feelahead.study.progress import Progress
from feelahead.study.protocol import Protocol
from feelahead.study.schedule import schedule, williams

ANSWER_S: Final = 10.0
"""Time assumed for one question"""


def places(protocol: Protocol) -> Mapping[tuple[str, int], int]:
    """Return how many of the planned participants meet each condition at each place, from 1."""
    planned = _orders(protocol, _planned(protocol))
    return Counter((name, place) for order in planned for place, name in enumerate(order, 1))


def follows(protocol: Protocol) -> Mapping[tuple[str, str], int]:
    """Return how many of the planned participants meet the second condition directly after the first."""
    planned = _orders(protocol, _planned(protocol))
    return Counter(pair for order in planned for pair in pairwise(order))


def delay_places(protocol: Protocol) -> tuple[int, int]:
    """Return how often, at least and at most, a delay stands at each place under each condition."""
    counts: Counter[tuple[str, int, float]] = Counter()
    for number, condition in product(_planned(protocol), protocol.conditions):
        delays = dict.fromkeys(one.delay_ms for one in schedule(protocol, number) if one.condition == condition)
        counts.update((condition, place, delay) for place, delay in enumerate(delays))
    possible = len(protocol.conditions) * len(protocol.delays_ms) ** 2
    return min(counts.values()) if len(counts) == possible else 0, max(counts.values())


def whole_square(protocol: Protocol) -> int:
    """Return the least number of participants over which the order of conditions is balanced."""
    return len(williams(len(protocol.conditions)))


def replacement(protocol: Protocol, withdrew: int, taken: Container[int]) -> int | None:
    """Return the number of who replaces one who withdrew: above all that are planned, and with the same order.

    That is the first number that is not `taken`, and is larger by a multiple of `whole_square`. None if none is left.
    """
    square = whole_square(protocol)
    later = range(withdrew + square, MOST_NUMBER + 1, square)
    return next((number for number in later if number > protocol.participants and number not in taken), None)


def next_number(protocol: Protocol, known: Container[int], withdrew: Iterable[int]) -> int:
    """Return the number of the next participant: planned and new, or in the place of one who withdrew.

    known: numbers that are taken. withdrew: those of who withdrew, in order.
    """
    square = whole_square(protocol)
    beyond = [number for number in range(protocol.participants + 1, MOST_NUMBER + 1) if number in known]
    for number in range(1, protocol.participants + 1):
        if number not in known:
            return number
    for gone in withdrew:
        same = next((number for number in beyond if number > gone and (number - gone) % square == 0), None)
        if same is not None:
            beyond.remove(same)
        elif (new := replacement(protocol, gone, known)) is not None:
            return new
    return next(number for number in range(protocol.participants + 1, MOST_NUMBER + 2) if number not in known)


def orders(protocol: Protocol, participants: Iterable[int]) -> Mapping[tuple[str, ...], int]:
    """Return how many of these participants have each order of conditions, also of those that none has."""
    possible = dict.fromkeys(_orders(protocol, range(1, whole_square(protocol) + 1)), 0)
    return possible | Counter(_orders(protocol, participants))


def most_minutes(protocol: Protocol) -> Mapping[str, float]:
    """Return the greatest duration of each part of a participant's session, in minutes.

    Each trial lasts to its limit, and each question 10 s; what lies between trials comes on top.
    """
    trials, practice, rest = len(schedule(protocol, 1)), protocol.practice, protocol.rest
    parts_s = {
        "practice": 0.0 if practice is None else practice.most * protocol.limit_s,
        "trials": trials * protocol.limit_s,
        "rests": 0.0 if rest is None else (trials - 1) // rest.trials * rest.seconds,
        "questions": len(protocol.questions) * len(protocol.conditions) * ANSWER_S,
    }
    return {name: duration_s / 60.0 for name, duration_s in parts_s.items()}


def left_minutes(protocol: Protocol, progress: Progress, participant: int) -> float:
    """Return the greatest duration of what is left for a participant, in minutes, reckoned as in `most_minutes`."""
    plan, done, rest, practice = (
        schedule(protocol, participant),
        len(progress.complete),
        protocol.rest,
        protocol.practice,
    )
    left_s = (len(plan) - done) * protocol.limit_s
    if practice is not None and progress.practised(practice) is None:
        tries = sum(one.begun.practice and one.status == "complete" for one in progress.attempts)
        left_s += (practice.most - tries) * protocol.limit_s
    if rest is not None:
        rests = set(range(rest.trials, len(plan), rest.trials)) - progress.rested
        left_s += rest.seconds * sum(after >= done for after in rests)
    return (left_s + len(protocol.questions) * (len(protocol.conditions) - len(progress.answers)) * ANSWER_S) / 60.0


def _orders(protocol: Protocol, numbers: Iterable[int]) -> list[tuple[str, ...]]:
    return [tuple(dict.fromkeys(one.condition for one in schedule(protocol, number))) for number in numbers]


def _planned(protocol: Protocol) -> range:
    return range(1, protocol.participants + 1)
