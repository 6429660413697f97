"""Operator side whose scripted person arms the arm again after each stop, also when the task is done."""

import sys
from typing import Any

from common.status.codes import Doing
from operator_side.main import command
from operator_side.people.glances import Glance
from operator_side.people.person import SimulatedOperator

_usual = SimulatedOperator._done


def _arms_again(person: SimulatedOperator, glance: Glance) -> None:
    _usual(person, glance)
    if glance.view.state != "armed":
        person._enter(Doing.RESTING, glance.now_s)


if __name__ == "__main__":
    vars_of: Any = SimulatedOperator
    vars_of._done = _arms_again
    sys.exit(command(sys.argv[1:]))
