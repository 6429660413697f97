"""Settings of both sides in a trial."""

from feelahead.study.protocol import Condition
from feelahead.study.schedule import Planned
from feelahead.study.trials.sides import side_values
from operator_side.settings import OperatorSettings


def test_no_participant_can_change_the_task() -> None:
    values = side_values(Planned(1, 1, "off", 0.0, "wall", 1, 7), Condition(haptics=False))
    assert OperatorSettings(**values.operator).fixed_task
