"""Settings of the operator side, from the command line or a TOML file."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final

import tyro
from msgspec import Meta

from common.command.run_options import SideOptions
from common.files.plugged import require_name
from common.limits import check_limits
from common.protocol.messages import Compensation
from common.sockets.round_robin import CONNECTIONS, MOST_CONNECTIONS_EACH
from operator_side.controller.port import check_choice
from operator_side.feel.rendering import RenderingSettings
from operator_side.hands.choices import SpeedScale, StickFrame
from operator_side.hands.travel_calibration import TravelCalibration
from operator_side.people.settings import PersonSettings

DEVICE_NAMES: Final = ("hid", "evdev", "simulated", "browser")
"""Keys of the table DEVICES in operator_side/controllers.py"""


@dataclass(frozen=True)
class OperatorSettings(SideOptions):
    """The operator side: a DualSense whose triggers stiffen in the direction of danger.

    It connects to a robot side, sends commands from the controller, and lets the fingers feel what is ahead. The arm
    moves only while L1 is held. Options arms it, with both triggers released. R2 advances, L2 retreats, the left stick
    moves across, the right stick turns. Cross closes the gripper, square opens it, triangle changes the target, circle
    stops everything, and create hands the robot over to the observer that has waited longest.
    In a recording the directional pad marks episodes: up starts one, right is success, left failure, down discards it.
    L3 changes the speed scale, the touchpad the frame of the sticks. Mute, held, moves the
    arm back to its start. R3 puts a simulated scene back, disarmed.
    """

    connect: Annotated[str, tyro.conf.arg(metavar="tcp://HOST:PORT")] = "tcp://127.0.0.1:5555"
    """Address of the robot side."""
    view_connect: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Address of the robot side's view port; by default the port after the control port."""
    keys: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Authenticate with the operator's key in FOLDER, made by: feelahead keys make operator. The robot side admits this
    key after this command on its machine: feelahead keys allow NAME KEY."""
    robot_key: Annotated[str | None, tyro.conf.arg(metavar="KEY|FILE")] = None
    """With --keys: the robot side's public key, shown on its machine by: feelahead keys show robot."""
    connections: Annotated[int, Meta(ge=1, le=MOST_CONNECTIONS_EACH)] = CONNECTIONS
    """Number of connections to the robot side, used in turn, so that a lost packet delays only the messages on its own
    connection. 8 help where packets are lost in bursts."""
    device: Annotated[str, tyro.conf.arg(metavar="NAME|FILE.py")] = "hid"
    """Controller. hid: a DualSense; if absent, it is waited for. evdev (Linux): any gamepad that rumbles. simulated: a
    simulated DualSense with a scripted person, which a page of the console may take over. browser: only a page of the
    console. FILE.py: a controller of your own (docs/controllers.md)."""
    controller: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS")] = None
    """Take only the DualSense with this address, as `feelahead doctor` prints it."""
    haptics: bool = True
    """Whether the triggers resist and the motors rumble."""
    compensation: Compensation = "operator"
    """Side that compensates the delay. operator: by the commands still under way. robot: by eq. 8."""
    speed_scale: SpeedScale = 1.0
    """Share of the full speed that full travel and full deflection command at first, 0.05 to 1. L3 changes it to 100,
    50 or 25 %."""
    stick_frame: StickFrame = "tool"
    """Frame in which the sticks move and turn the tool at first: the tool's, the base's or that of the overview's
    picture. The touchpad changes it. The triggers always move along the tool."""
    fixed_task: bool = False
    """Refuse marks of episodes, putting the scene back, and another target: for a study."""
    swap_sides: bool = False
    """Swap left and right: L2 advances, R2 retreats, R1 is held to run, the right stick moves across, the left stick
    turns."""
    calibration: Annotated[TravelCalibration, tyro.conf.Suppress] = field(default_factory=TravelCalibration)
    """Only in a TOML file: calibration of triggers and sticks, their dead zones, saturation and rest positions."""
    rendering: RenderingSettings = field(default_factory=RenderingSettings)
    """Rendering of onset distances as stiffness."""
    console: bool = False
    """Serve the console for a browser on this machine, and show its address: views, scene, what is felt and why."""
    console_port: Annotated[int, tyro.conf.arg(metavar="PORT"), Meta(ge=0, le=65535)] = 0
    """Port of the console on 127.0.0.1; 0 for any free port."""
    console_token: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File that contains the token of the console's address, for a program that restarts this side while the page stays
    open. Pages then offer to run again, and --status json has an event for it."""
    console_back: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File that contains the address to which the console's page goes once the run is over. The page then shows what a
    person needs to drive, and nothing that tells law, haptics or delay: for a study (docs/console.md)."""
    tui: bool = False
    """Show the console's facts on the whole terminal instead of one line, for machines without a browser."""
    person: Annotated[PersonSettings, tyro.conf.Suppress] = field(default_factory=PersonSettings)
    """Only in a TOML file: abilities and errors of the scripted person (only with --device simulated)."""
    person_file: Annotated[Path | None, tyro.conf.arg(metavar="FILE.py")] = None
    """A person of your own instead of the scripted one (only with --device simulated; docs/python.md)."""
    pull_n: Annotated[Annotated[float, Meta(ge=0.0, le=20.0)] | None, tyro.conf.arg(metavar="NEWTONS")] = None
    """Instead of the scripted person, arm the robot and then pull R2 with this force until the end (only with --device
    simulated). 2 N is a light pull, 3.7 N a normal one."""
    person_waits: Annotated[float, Meta(ge=0.0, le=3600.0), tyro.conf.arg(metavar="SECONDS")] = 0.0
    """Longest time, in seconds, that the scripted person waits for the first picture on a page of the console, counted
    from the robot side's first telemetry."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_limits(self)
        if self.tui and self.status != "line":
            raise ValueError(f"--tui and --status {self.status} exclude each other; valid: only one of them")
        require_name("controller", self.device, DEVICE_NAMES)
        check_choice(self.device, self.controller)
        if self.console_token is not None:
            _check_token(self.console_token)
        if self.console_back is not None and not self.console_back.is_file():
            raise ValueError(f"--console-back {self.console_back}: there is no such file; valid: an existing file")
        if self.robot_key is not None and self.keys is None:
            raise ValueError(
                "--robot-key is given without --keys; valid: both (`feelahead keys make operator` makes our key)"
            )
        if self.pull_n is not None and (self.swap_sides or self.person_file is not None):
            other = "--swap-sides" if self.swap_sides else "--person-file"
            raise ValueError(f"{other} and --pull-n exclude each other, as a finger pulls R2; valid: only one of them")

    @property
    def tells_facts(self) -> bool:
        """Whether the console's facts are shown in the terminal (--tui) or printed for a program (--status facts)."""
        return self.tui or self.status == "facts"


def _check_token(path: Path) -> None:
    """Raise ValueError unless the file holds a token that belongs into an address and cannot be guessed."""
    try:
        token = path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        token = ""
    if re.fullmatch(r"[\w-]{22,}", token) is None:
        raise ValueError(f"--console-token {path}; valid: a file with 22 or more of the characters A-Z a-z 0-9 - _")
