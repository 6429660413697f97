"""Settings of one trial over a wide area."""

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from msgspec import Meta

from common.limits import Limited
from tests.two_hosts.wide_area.wire_direction import Direction, DirectionSettings


@dataclass(frozen=True)
class Trial(Limited):
    """One link, and the load on it. `question.WideSweep` explains the fields of the same name."""

    delay: Annotated[float, Meta(ge=0.0, le=5000.0)] = 100.0
    loss: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0
    burst: Annotated[float, Meta(ge=0.0, le=5000.0)] = 0.0
    rate: Annotated[float, Meta(ge=0.0, le=1e4)] = 0.0
    queue: Annotated[float, Meta(ge=0.0, le=1e5)] = 200.0
    control: str = "reno"
    connections: Annotated[int, Meta(ge=0, le=64)] = 0
    person: Literal["drives", "rests"] = "drives"
    pictures: bool = False
    observer: Literal["none", "reads", "stops"] = "none"
    seconds: Annotated[float, Meta(ge=2.0, le=3600.0)] = 20.0

    def ways(self) -> dict[Direction, DirectionSettings]:
        """Return the settings of both directions, in SI units."""
        words = DirectionSettings(self.delay / 1e3, self.loss / 1e2, self.burst / 1e3, queue_s=self.queue / 1e3)
        return {"to_operator": replace(words, rate_bit_s=1e6 * self.rate), "to_robot": words}
