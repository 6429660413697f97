"""An arm and a law whose time counts to a stage of the turn."""

from common.realtime.stages import Stages
from robot_side.arm.port import Arm
from robot_side.laws.law import Law

STAGES = ("sockets", "messages", "physics", "sensing")
"""Of a turn: sending and receiving; decoding and judging what arrived; the arm's state, for which a simulation
advances; the law. All else of a tick is the rest."""
HELPS = {
    "sockets": "fewer views and observers",
    "messages": "fewer observers",
    "physics": 'fewer free bodies, a longer timestep or <flag sleep="enable"/> in the model',
    "sensing": "fewer or simpler objects, or a coarser cover (cover_m)",
    "": "fewer views, or a faster machine",
}
"""What makes each of them shorter."""


class TimedArm:
    """As the arm that it stands in front of."""

    def __init__(self, arm: Arm, stages: Stages) -> None:
        self.joint_count = arm.joint_count
        self.command, self.command_gripper = arm.command, arm.command_gripper
        self.state = stages.timed("physics", arm.state)


class TimedLaw:
    """As the law that it stands in front of."""

    def __init__(self, law: Law, stages: Stages) -> None:
        self.sense = stages.timed("sensing", law.sense)
        self.around, self.summary = law.around, law.summary
