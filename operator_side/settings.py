"""Everything about the operator side that a person may set, on the command line or in a TOML file."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from common.command.run_options import SideOptions
from common.limits import check_limits
from common.protocol.messages import Compensation
from common.sockets.turns import CONNECTIONS, MOST_CONNECTIONS_EACH
from operator_side.feel.rendering import RenderingSettings
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.settings import PersonSettings

DeviceName = Literal["hid", "evdev", "simulated", "browser"]
"""The names of operator_side/controllers.py"""


@dataclass(frozen=True)
class OperatorSettings(SideOptions):
    """The operator side: a DualSense whose triggers stiffen in the direction of danger.

    It connects to a robot side, sends what the hands do, and lets the fingers feel what is ahead. L1 held: the
    arm may move. Options: arm it, with released triggers. R2 advances, L2 retreats, the left stick moves
    across, the right one turns. Cross closes and square opens the gripper, triangle changes the target, circle
    stops everything, and create hands the robot over to whoever has waited longest.
    """

    connect: Annotated[str, tyro.conf.arg(metavar="tcp://HOST:PORT")] = "tcp://127.0.0.1:5555"
    """Where the robot side listens."""
    view_connect: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Where it publishes what the screen shows; the port after the control port unless given."""
    keys: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Prove who we are with the operator's key in FOLDER, made by: feelahead keys make operator. The robot side lets
    it in after: feelahead keys allow NAME KEY."""
    robot_key: Annotated[str | None, tyro.conf.arg(metavar="KEY|FILE")] = None
    """With --keys: the robot side's public key, as shown on its machine by: feelahead keys show robot."""
    connections: Annotated[int, Meta(ge=1, le=MOST_CONNECTIONS_EACH)] = CONNECTIONS
    """Messages go to the robot side and back over several connections in turn. A packet that the network loses then
    holds up a part of the messages, and newer ones overtake. 8 help where packets are lost in bursts."""
    device: DeviceName = "hid"
    """A DualSense, which is waited for while it is not there; by evdev (Linux) any gamepad that rumbles; a simulated
    DualSense with a scripted person, out of whose hands a page of the console may take it; or a page alone."""
    haptics: bool = True
    """Whether the triggers are stiffened at all."""
    compensation: Compensation = "operator"
    """Who reckons with the delay: this side, by its own commands still under way, or the robot side, by eq. 8."""
    swap_sides: bool = False
    """Left and right swapped: L2 advances and R2 retreats, R1 is held to run, the right stick moves across and the left
    one turns."""
    calibration: TravelCalibration = field(default_factory=TravelCalibration)
    """Which part of the triggers' and sticks' travel counts."""
    rendering: RenderingSettings = field(default_factory=RenderingSettings)
    """How what lies ahead becomes what the fingers feel."""
    console: bool = False
    """The browser console on this machine, at an address that is shown: both views, the scene, what is felt and why."""
    console_port: Annotated[int, tyro.conf.arg(metavar="PORT"), Meta(ge=0, le=65535)] = 0
    """Where it listens, on 127.0.0.1 alone; 0 for any port that is free."""
    tui: bool = False
    """The same on the whole terminal instead of a line, for machines without a browser; pictures aside."""
    person: PersonSettings = field(default_factory=PersonSettings)
    """The scripted person's limits (simulated device only)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_limits(self)
        if self.tui and self.status != "line":
            raise ValueError(f"--tui with --status {self.status}; valid: one of them")
        if self.robot_key is not None and self.keys is None:
            raise ValueError("--robot-key without --keys; valid: both (feelahead keys make operator makes ours)")
        if self.swap_sides and self.person.pull_n is not None:
            raise ValueError("--swap-sides with --person.pull-n: valid: one of them, as the finger pulls R2 to advance")

    @property
    def tells_facts(self) -> bool:
        """Whether all that the console shows goes to the terminal, or to a program."""
        return self.tui or self.status == "facts"
