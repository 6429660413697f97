"""Plan of a participant's trials: conditions in blocks, in an order that is balanced over participants."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import gcd

import numpy as np

from feelahead.study.protocol import Protocol


@dataclass(frozen=True)
class Planned:
    """One trial of a participant's plan."""

    number: int
    """Place in the plan, from 1"""
    block: int
    """Place of the condition, from 1"""
    condition: str
    delay_ms: float
    scene: str
    repeat: int
    """Which of the cell's repetitions, from 1"""
    seed: int
    """Seed of the run; the same under each condition, so that trials can be compared in pairs"""


def williams(number: int) -> tuple[tuple[int, ...], ...]:
    """Return the rows of a balanced Latin square of `number` treatments; twice as many for an odd number.

    Each treatment stands equally often at each place, and directly after each other one. Williams, Experimental designs
    balanced for the estimation of residual effects of treatments, Australian Journal of Scientific Research A 2, 1949.
    """
    zigzag = [(place + 1) // 2 if place % 2 else -(place // 2) for place in range(number)]
    rows = [tuple((step + shift) % number for step in zigzag) for shift in range(number)]
    return (*rows, *(row[::-1] for row in rows)) if number % 2 else tuple(rows)


@lru_cache(maxsize=64)
def schedule(protocol: Protocol, participant: int) -> tuple[Planned, ...]:
    """Return the plan of the participant with this number, from 1.

    A block has one condition. In it the delays stand one after the other, in their own balanced order. At each delay
    the scenes and repetitions stand in an order that is drawn. A condition meets each order of the delays equally often
    over few participants, and at each place over more.
    """
    conditions, orders = tuple(protocol.conditions), williams(len(protocol.conditions))
    delay_orders = williams(len(protocol.delays_ms))
    group, row = divmod(participant - 1, len(orders))
    # Groups after which the orders of the delays would come back at the same places.
    cycle = len(delay_orders) // gcd(len(conditions), len(delay_orders))
    planned: list[Planned] = []
    for block, condition in enumerate(orders[row]):
        generator = np.random.default_rng([protocol.seed, participant, block])
        delays = delay_orders[(group * len(conditions) + group // cycle + block) % len(delay_orders)]
        for delay in delays:
            cells = list(product(range(len(protocol.scenes)), range(protocol.trials)))
            for scene, repeat in (cells[place] for place in generator.permutation(len(cells))):
                planned.append(
                    Planned(
                        number=len(planned) + 1,
                        block=block + 1,
                        condition=conditions[condition],
                        delay_ms=protocol.delays_ms[delay],
                        scene=protocol.scenes[scene],
                        repeat=repeat + 1,
                        seed=seed_of([protocol.seed, participant, delay, scene, repeat]),
                    )
                )
    return tuple(planned)


def seed_of(numbers: Sequence[int]) -> int:
    """Return a seed of 32 bits, drawn from `numbers`."""
    return int(np.random.SeedSequence(numbers).generate_state(1)[0])
