"""All kernels that a robot side runs are compiled before its first tick."""

import sys

import pytest

from robot_side.compiled.warm_up import import_kernels
from robot_side.laws.named import LAWS
from tests.helpers.python_process import ended


@pytest.mark.processes
@pytest.mark.parametrize("law", LAWS)
def test_whatever_it_has_to_do_it_compiles_nothing_once_it_has_begun(law: str) -> None:
    # In a process of its own: here other tests have imported and compiled more than a robot side does.
    code, _, complaint = ended("-m", "tests.robot_side.compiled.every_duty", law)
    assert code == 0, complaint


def test_they_are_found_on_a_robot_machine_without_the_extra_for_video(monkeypatch: pytest.MonkeyPatch) -> None:
    everything = import_kernels()
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.delitem(sys.modules, "robot_side.viewing.h264", raising=False)
    assert import_kernels() == everything
