"""Listeners that record a run: the core's inputs, and the truth of a simulation."""

from collections.abc import Callable
from typing import Any

from robot_side.drivers.mujoco.arm import MujocoArm
from robot_side.drivers.mujoco.simulation_witness import SimulationWitness
from robot_side.parts import SceneParts
from robot_side.recording.recorder import RobotRecorder
from robot_side.recording.true_states import TrueStates
from robot_side.tick.events import Listener


def recorders(parts: SceneParts, note: Callable[[Any], None]) -> list[Listener]:
    """Return the listeners that give a recording what they note of a run with these parts."""
    if parts.truth is None or not isinstance(parts.arm, MujocoArm):
        return [RobotRecorder(note)]
    return [RobotRecorder(note), TrueStates(SimulationWitness(parts.scene, parts.arm), parts.truth, note)]
