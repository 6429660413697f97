"""True states of a run whose target is made up."""

from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from common.recording.topics import Truth
from robot_side.recording.true_states import TrueStates
from robot_side.tick.truth import TargetTruth


class Made:
    """Simulation whose target stands at a height above its support; nothing is touched."""

    roles: ClassVar[dict[str, Any]] = {}
    impulse_n_s = 0.0
    tool_m = (0.0, 0.0, 0.0)
    gap_m = 0.0

    def touches(self, held: str | None) -> None:
        del held

    def observe(self) -> Any:
        target = TargetTruth(np.zeros(3), self.gap_m, 0.0, 0.0)
        return SimpleNamespace(target=target, min_obstacle_distance_m=None)


def test_a_scene_that_was_put_back_has_no_placed_target() -> None:
    made, noted = Made(), list[Truth]()
    states = TrueStates(made, made, lambda entry: noted.append(entry[2]))  # type: ignore[arg-type, index]
    for now_s, (gap_m, held) in enumerate([(0.0, True), (0.1, True), (0.0, True), (0.0, False)]):
        made.gap_m = gap_m
        situation = SimpleNamespace(held=None)
        found = SimpleNamespace(situation=situation, holds_target=held, motion_state="armed")
        states.on_tick(SimpleNamespace(found=found))  # type: ignore[arg-type]
        states.on_sent(float(now_s))
    states.on_episode("start", 4.0)
    states.on_sent(4.0)
    states.on_episode("reset", 5.0)
    states.on_sent(5.0)
    assert [one.placed for one in noted] == [False, False, False, True, True, False]
