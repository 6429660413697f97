"""Settings of `feelahead demo`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from common.command.run_options import RunOptions
from common.limits import check_limits
from common.protocol.messages import Compensation
from robot_side.laws.named import LawName


@dataclass(frozen=True)
class DemoSettings(RunOptions):
    """Both sides on this machine: a simulated arm, a simulated DualSense, and a scripted person.

    The person arms the arm and pulls R2 to advance towards the target. They feel the trigger stiffen near objects.
    Then they grasp the target, lift it, and set it down again. Nothing is needed but this machine.

    Try: feelahead demo --link "delay 50ms 10ms distribution normal", and the same with --no-haptics.
    """

    compare: bool = False
    """Run the same seed without and with haptics, by a person who misjudges depth, and play both side by side. Computed
    first, in virtual time. Default scene: wall."""
    scene: Literal["table", "wall", "slot", "shelf"] | None = None
    """Objects around the built-in arm's target. table: a cluttered table (default). wall: a wall 10 to 60 mm behind it.
    slot: two posts in front of it, 15 to 40 mm to spare on each side. shelf: a shelf with a raised front edge to reach
    over. The last three are drawn from the seed."""
    duration: Annotated[float | None, tyro.conf.arg(metavar="SECONDS")] = None
    """Duration of the run with the link up. Default: until 5 s after the last page of the console was closed, 60 s if
    none was opened. Without a page (--no-console, --tui, or not from a terminal): 30 s."""
    probability: Annotated[float, tyro.conf.arg(metavar="P")] = 0.99
    """Share of contacts that a warning must precede, between 0 and 1 (eq. 10)."""
    assist: Literal["none", "speed"] = "none"
    """speed: the robot side caps the speed along the triggers, so that the arm stops where full strength begins."""
    law: LawName = "swept"
    """Law of the stiffness. swept: early enough to release, along each trigger; paper: the paper's plain law."""
    compensation: Compensation = "operator"
    """Side that compensates the delay: operator, by the commands under way; robot, by v t_d (eq. 8)."""
    haptics: bool = True
    """Whether the triggers are stiffened; without, the same person only sees."""
    model: Annotated[Path | None, tyro.conf.arg(metavar="FILE.xml")] = None
    """MJCF arm with actuators, instead of the built-in one."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """Site of the model between the fingertips, with the z axis along the approach."""
    realtime: bool = False
    """Real-time scheduling and locked memory for both sides, if permitted."""
    console: bool = True
    """Browser console, at an address that is shown; from a terminal with a display it opens by itself."""
    console_port: Annotated[int, Meta(ge=0, le=65535), tyro.conf.arg(metavar="PORT")] = 0
    """Port of the console's page on this machine; 0: any free one."""
    tui: bool = False
    """Full-screen terminal instead of a line, for machines without a browser."""
    robot_config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """More settings for the robot side: see feelahead-robot --help."""
    operator_config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """More settings for the operator side: see feelahead-operator --help."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_limits(self)
        if self.tui and self.status != "line":
            raise ValueError(f"--tui with --status {self.status}; valid: one of them")
        if self.scene is not None and self.model is not None:
            raise ValueError(f"--scene {self.scene} with --model: valid: one of them; a model brings its own scene")

    @property
    def has_pages(self) -> bool:
        """Whether pages of the console can be opened."""
        return self.console and not self.tui
