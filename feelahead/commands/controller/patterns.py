"""Patterns of strengths to feel one after the other, without I/O."""

from typing import Final, Literal, NamedTuple, get_args

from operator_side.controller.feel import FREE_TRIGGER, MAX_STRENGTH, ZONE_COUNT, Strengths

PatternName = Literal["free", "wall", "ramp", "strengths"]


class Stage(NamedTuple):
    """Strengths that both triggers have for some time."""

    pattern: PatternName
    words: str
    strengths: Strengths
    lasts_s: float


_WALL_ZONE: Final = 4
"""Zone at about the middle of a full pull, which ends in zone 7"""

STAGES: Final = (
    Stage("free", "free: only the spring", FREE_TRIGGER, 5.0),
    Stage(
        "wall",
        "a wall at the middle",
        tuple(MAX_STRENGTH if zone >= _WALL_ZONE else 0 for zone in range(ZONE_COUNT)),
        6.0,
    ),
    Stage(
        "ramp",
        "a rising ramp: each zone one stronger",
        tuple(min(zone + 1, MAX_STRENGTH) for zone in range(ZONE_COUNT)),
        6.0,
    ),
    *(
        Stage("strengths", f"strength {strength} of {MAX_STRENGTH} everywhere", (strength,) * ZONE_COUNT, 3.0)
        for strength in range(1, MAX_STRENGTH + 1)
    ),
)


class Walk:
    """Walk through the stages of all patterns, or of one, again and again."""

    def __init__(self, pattern: PatternName | None = None) -> None:
        self.rounds = 0
        """Number of times that all stages were walked through."""
        self._since_s: float | None = None
        self.choose(pattern)

    @property
    def stage(self) -> Stage:
        """Present stage."""
        return self._stages[self._index]

    def choose(self, pattern: PatternName | None) -> None:
        """Begin with the first stage of `pattern` and stay in that pattern; None for all patterns."""
        self._stages = tuple(stage for stage in STAGES if pattern in (None, stage.pattern))
        self._index, self._since_s = 0, None

    def skip(self) -> None:
        """Go on through all patterns, with the first stage of the next one."""
        names = get_args(PatternName)
        following = names[(names.index(self.stage.pattern) + 1) % len(names)]
        self.choose(None)
        self._index = next(n for n, stage in enumerate(self._stages) if stage.pattern == following)

    def advance(self, now_s: float) -> None:
        """Go to the next stage if the present one has lasted long enough."""
        if self._since_s is None:
            self._since_s = now_s
        elif now_s - self._since_s >= self.stage.lasts_s:
            self._since_s = now_s
            self._index = (self._index + 1) % len(self._stages)
            self.rounds += self._index == 0
