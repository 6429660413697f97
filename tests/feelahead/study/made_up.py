"""Made-up tables of a study, with effects that are known."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np
import pandas as pd

from feelahead.study.protocol import Condition, Contrast, Protocol
from feelahead.study.questionnaires import Item
from feelahead.study.report.outcomes import Tables
from feelahead.study.schedule import Planned, schedule

PROTOCOL: Final = Protocol(
    name="Made-up study",
    participants=12,
    seed=7,
    controller="gamepad",
    conditions={
        "off": Condition(haptics=False),
        "swept": Condition(),
        "margin": Condition(law="margin", margin_m=0.04),
        "assist": Condition(assist="speed"),
    },
    scenes=("shelf", "wall"),
    delays_ms=(0.0, 100.0, 200.0),
    contrasts=(Contrast("hit", "off", "swept"), Contrast("time_s", "off", "swept"), Contrast("hit", "margin", "swept")),
    items=(Item("I felt in control"),),
)


@dataclass(frozen=True)
class Effects:
    """What a condition does, and how much persons differ: log odds of a hit, and logarithms of the time."""

    hit: Mapping[str, float]
    time: Mapping[str, float]
    between: float = 0.8
    """Standard deviation of persons' log odds; of their logarithm of time a quarter"""
    slope: float = 0.5
    """The same of persons' effects of a condition"""


NONE: Final = Effects(dict.fromkeys(PROTOCOL.conditions, -1.0), dict.fromkeys(PROTOCOL.conditions, 0.0))
STRONG: Final = Effects(
    {"off": 0.0, "swept": -4.0, "margin": -2.0, "assist": -5.0},
    {"off": 0.0, "swept": 0.15, "margin": 0.3, "assist": 0.25},
)


def made_up(
    effects: Effects = STRONG, protocol: Protocol = PROTOCOL, people: int | None = None, seed: int = 0
) -> Tables:
    """Return tables of a study of `people` participants (the planned ones if None) without any fault."""
    generator = np.random.default_rng(seed)
    trials: list[dict[str, Any]] = []
    answers: list[dict[str, Any]] = []
    for participant in range(1, (people or protocol.participants) + 1):
        person = generator.normal(0.0, effects.between)
        slopes = {name: generator.normal(0.0, effects.slope) for name in protocol.conditions}
        plan = schedule(protocol, participant)
        for planned in plan:
            own, slow = person + slopes[planned.condition], planned.delay_ms / 100.0
            odds = effects.hit[planned.condition] + own + 0.4 * slow
            hit = bool(generator.random() < 1.0 / (1.0 + np.exp(-odds)))
            logarithm = effects.time[planned.condition] + own / 4.0 + 0.2 * slow - 0.05 * planned.block
            time_s = float(9.0 * np.exp(logarithm + generator.normal(0.0, 0.25)))
            trials.append({"participant": participant} | _trial(protocol, planned, hit, time_s, generator))
        for block, condition in sorted({(one.block, one.condition) for one in plan}):
            place = {"participant": participant, "block": block, "condition": condition}
            asked = ((question.name, generator.choice(question.values)) for question in protocol.questions)
            answers += [place | {"item": name, "value": float(value)} for name, value in asked]
    enrolled = tuple(range(1, (people or protocol.participants) + 1))
    return Tables(protocol, pd.DataFrame(trials), pd.DataFrame(answers), enrolled=enrolled)


def _trial(
    protocol: Protocol, planned: Planned, hit: bool, time_s: float, generator: np.random.Generator
) -> dict[str, Any]:
    done = time_s < protocol.limit_s
    return asdict(planned) | {
        **{"trial": planned.number, "attempt": 1, "practice": False, "status": "complete", "excluded": None},
        **{"completed": done, "time_s": time_s if done else None, "hit": hit},
        "contacts": int(hit) + int(hit and generator.random() < 0.3),
        "fastest_mm_s": float(generator.uniform(20.0, 200.0)) if hit else None,
        "impulse_n_s": float(generator.gamma(2.0, 0.1)) if hit else 0.0,
        "path_m": float(0.5 * np.exp(generator.normal(0.0, 0.1))),
        "least_mm": 0.0 if hit else float(generator.gamma(3.0, 4.0)),
        **{"exposure_s": float(generator.gamma(1.0, 0.2)), "recording": f"trials/t{planned.number:03}.mcap"},
        "enlargement_mm": 30.0 + 0.1 * planned.delay_ms,
    }
