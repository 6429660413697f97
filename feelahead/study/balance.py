"""How balanced the plans of a study's participants are, and how long each takes at most."""

from collections import Counter
from collections.abc import Mapping
from itertools import pairwise, product
from typing import Final

from feelahead.study.progress import Progress
from feelahead.study.protocol import Protocol
from feelahead.study.schedule import schedule, williams

ANSWER_S: Final = 10.0
"""Time assumed for one question"""


def places(protocol: Protocol) -> Mapping[tuple[str, int], int]:
    """Return how many of the planned participants meet each condition at each place, from 1."""
    return Counter((name, place) for order in _orders(protocol) for place, name in enumerate(order, 1))


def follows(protocol: Protocol) -> Mapping[tuple[str, str], int]:
    """Return how many of the planned participants meet the second condition directly after the first."""
    return Counter(pair for order in _orders(protocol) for pair in pairwise(order))


def delay_places(protocol: Protocol) -> tuple[int, int]:
    """Return how often, at least and at most, a delay stands at each place under each condition."""
    counts: Counter[tuple[str, int, float]] = Counter()
    for number, condition in product(range(1, protocol.participants + 1), protocol.conditions):
        delays = dict.fromkeys(one.delay_ms for one in schedule(protocol, number) if one.condition == condition)
        counts.update((condition, place, delay) for place, delay in enumerate(delays))
    possible = len(protocol.conditions) * len(protocol.delays_ms) ** 2
    return min(counts.values()) if len(counts) == possible else 0, max(counts.values())


def whole_square(protocol: Protocol) -> int:
    """Return the least number of participants over which the order of conditions is balanced."""
    return len(williams(len(protocol.conditions)))


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


def _orders(protocol: Protocol) -> list[list[str]]:
    numbers = range(1, protocol.participants + 1)
    return [list(dict.fromkeys(one.condition for one in schedule(protocol, number))) for number in numbers]
