"""Protocol of a study, from a TOML file: who does what, how often, and what is compared."""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from common.command.command_line import load_toml
from common.limits import Limited, check_limits
from feelahead.study.questionnaires import Item, Question, questions
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.laws.named import LAWS, require_law

ControllerName = Literal["dualsense", "gamepad", "keyboard"]
STANDS_S: Final = 0.5
"""Time for which the target must stand until it counts as placed, and the trial ends"""
MARGIN: Final = "margin"
"""Law that needs `margin_m`"""
OUTCOMES: Final = (
    *("completed", "time_s", "contacts", "hit", "fastest_mm_s", "impulse_n_s", "path_m", "least_mm", "exposure_s"),
    "enlargement_mm",
)
"""Outcomes of a trial, as the table's columns are named"""
RAW_TLX: Final = "tlx"
"""Outcome of a block: the raw score of NASA-TLX"""
_NAME: Final = re.compile(r"[a-z0-9][a-z0-9_-]{0,31}")
_Count = Annotated[int, Meta(ge=1, le=999)]
_Duration = Annotated[float, Meta(gt=0.0, le=3600.0)]
_Delay = Annotated[float, Meta(ge=0.0, le=2000.0)]


@dataclass(frozen=True)
class Condition(Limited):
    """What differs between blocks; each setting becomes a flag of a side."""

    haptics: bool = True
    """Whether the triggers resist and the motors rumble"""
    law: str = "swept"
    """Law of the stiffness"""
    margin_m: Annotated[float, Meta(gt=0.0, le=0.5)] | None = None
    """Fixed distance at which the law `margin` begins"""
    assist: Literal["none", "speed"] = "none"
    """Help besides stiffness"""

    def __post_init__(self) -> None:
        check_limits(self)
        require_law(self.law, LAWS)
        if (self.law == MARGIN) != (self.margin_m is not None):
            raise ValueError(f'margin_m = {self.margin_m} with law = "{self.law}"; valid: both margin_m and "{MARGIN}"')


@dataclass(frozen=True)
class Contrast:
    """Planned comparison of two conditions."""

    outcome: str
    """Outcome of a trial, the raw score "tlx", or the name of a question"""
    first: str
    second: str
    correct: str = "all"
    """Name of the family of contrasts in which Holm's correction is made"""


@dataclass(frozen=True)
class PracticeSettings(Limited):
    """Tries before the first block, in one cell, until enough in a row succeed."""

    scene: SceneName
    condition: str
    delay_ms: _Delay = 0.0
    successes: _Count = 3
    """Successes in a row that end the practice"""
    most: _Count = 12
    """Number of tries after which it ends without them"""

    def __post_init__(self) -> None:
        check_limits(self)
        if self.successes > self.most:
            raise ValueError(f"successes = {self.successes}; valid: at most the {self.most} tries of most")


@dataclass(frozen=True)
class RestSettings(Limited):
    """Rests between trials."""

    trials: _Count = 15
    """Number of trials between two rests"""
    seconds: _Duration = 60.0


@dataclass(frozen=True)
class Protocol(Limited):
    """Within-subject study: every participant meets each condition, delay and scene."""

    name: Annotated[str, Meta(min_length=1, max_length=80)]
    participants: _Count
    """Planned number of participants; above it are those who replace one who withdrew"""
    seed: Annotated[int, Meta(ge=0, lt=2**32)]
    controller: ControllerName
    conditions: dict[str, Condition] = field(hash=False)
    """Conditions by name, in their order"""
    scenes: tuple[SceneName, ...]
    delays_ms: tuple[_Delay, ...]
    """Emulated delays, one way"""
    trials: _Count = 3
    """Repetitions of each cell: condition, delay and scene"""
    limit_s: _Duration = 45.0
    """Time after which a trial ends"""
    withdrawn: Literal["keep", "remove"] = "remove"
    """Data of a participant who withdraws. remove: only the number stays, and that somebody withdrew"""
    practice: PracticeSettings | None = None
    rest: RestSettings | None = None
    contrasts: tuple[Contrast, ...] = ()
    items: tuple[Item, ...] = ()
    tlx: bool = True
    """Whether NASA-TLX is asked after each block"""

    def __post_init__(self) -> None:
        check_limits(self)
        known = tuple(self.conditions)
        _require_each_once("conditions", known)
        _require_each_once("scenes", self.scenes)
        _require_each_once("delays_ms", self.delays_ms)
        _require_each_once("items", [question.name for question in self.questions], none=True)
        _require_each_once("contrasts", self.contrasts, none=True)
        for name in known:
            if not _NAME.fullmatch(name):
                raise ValueError(f"conditions.{name}: valid: up to 32 lower letters, digits, - and _")
        if self.practice is not None:
            _require_one_of("practice.condition", self.practice.condition, known)
        outcomes = (*OUTCOMES, *((RAW_TLX,) if self.tlx else ()), *(question.name for question in self.questions))
        for number, contrast in enumerate(self.contrasts):
            _require_one_of(f"contrasts[{number}].outcome", contrast.outcome, outcomes)
            _require_one_of(f"contrasts[{number}].first", contrast.first, known)
            others = tuple(name for name in known if name != contrast.first)
            _require_one_of(f"contrasts[{number}].second", contrast.second, others)

    @property
    def questions(self) -> tuple[Question, ...]:
        """What is asked after each block"""
        return questions(self.items, tlx=self.tlx)

    @property
    def hash(self) -> str:
        """Name of what the protocol says, whatever the file's layout and comments: 16 hexadecimal digits"""
        content = json.dumps(msgspec.to_builtins(self), ensure_ascii=False)
        return hashlib.sha256(content.encode()).hexdigest()[:16]


def load_protocol(path: Path) -> Protocol:
    """Read a protocol; ConfigurationError, in one line, names file, key and valid values."""
    return load_toml(path, Protocol, flag="protocol")


def _require_each_once(name: str, values: Iterable[object], *, none: bool = False) -> None:
    counts = Counter(values)
    if twice := [value for value, count in counts.items() if count > 1]:
        raise ValueError(f"{name}: {twice[0]} stands there twice; valid: each once")
    if not counts and not none:
        raise ValueError(f"{name}: none; valid: one or more")


def _require_one_of(name: str, value: str, valid: Iterable[str]) -> None:
    if value not in (valid := tuple(valid)):
        raise ValueError(f"{name} = {value!r}; valid: {', '.join(valid)}")
