"""With NUMBA_DISABLE_JIT=1 a debugger stops inside a look, and the look finds what the compiled one finds."""

import json

import numpy as np
import pytest

from tests.helpers.python_process import ended
from tests.robot_side.compiled.stepped_look import FREE_MM, SCENES, onsets_m


@pytest.mark.processes
def test_a_look_runs_under_a_debugger_and_finds_the_same_distances() -> None:
    code, said, complaint = ended("-m", "tests.robot_side.compiled.stepped_look", NUMBA_DISABLE_JIT="1")
    assert code == 0, complaint
    stepped = json.loads(said)
    assert stepped["stops"] == len(SCENES) * len(FREE_MM)
    np.testing.assert_allclose(stepped["onsets_m"], onsets_m(), rtol=1e-9, atol=1e-12)
