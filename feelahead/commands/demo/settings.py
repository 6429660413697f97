"""Settings of `feelahead demo`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from common.command.run_options import RunOptions
from common.limits import check_limits
from common.protocol.messages import Compensation
from robot_side.laws.named import require_law
from robot_side.laws.paper_settings import PaperFlags


@dataclass(frozen=True)
class DemoSettings(PaperFlags, RunOptions):
    """Both sides on this machine: a simulated arm, a simulated DualSense, and a scripted person.

    The person arms the arm and pulls R2 to advance towards the target. They feel the trigger stiffen near objects.
    Then they grasp the target, lift it, and set it down again. Neither a robot nor a controller is needed.

    Try: feelahead demo --link "delay 50ms 10ms distribution normal", then the same with --no-haptics.
    """

    compare: bool = False
    """Run the same seed without and with haptics, by a person who misjudges depth, and play both side by side. Computed
    first, in virtual time. Default scene: wall."""
    scene: Annotated[
        Literal["table", "wall", "slot", "shelf"] | None, tyro.conf.arg(metavar="{table,wall,slot,shelf}")
    ] = None
    """Objects around the built-in arm's target. table: a cluttered table (default). wall: a wall 10 to 60 mm behind the
    target. slot: two posts in front of the target, with 15 to 40 mm to spare on each side. shelf: the target stands on
    a shelf with a raised front edge. The exact sizes of the last three are drawn from the seed."""
    perception: Annotated[Literal["depth"] | None, tyro.conf.arg(metavar="depth")] = None
    """depth: simulated depth cameras see the surfaces, which nobody models (docs/depth.md)."""
    duration: Annotated[float | None, tyro.conf.arg(metavar="SECONDS")] = None
    """Duration of the run, counted from when the link is up. Unless given, the run ends 5 s after the last page of the
    console was closed, or after 60 s without a page. Where no page can open (--no-console, --tui, or output that is no
    terminal) it ends after 30 s."""
    probability: Annotated[float, Meta(gt=0.0, lt=1.0), tyro.conf.arg(metavar="P")] = 0.99
    """Share of approaches in which the warning must come before the contact, between 0 and 1 (eq. 10)."""
    assist: Literal["none", "speed"] = "none"
    """speed: the robot side caps the speed along the triggers, so that the arm stops where full strength begins."""
    law: Annotated[str, tyro.conf.arg(metavar="NAME|FILE.py")] = "swept"
    """Law of the stiffness. swept: stiffness along the direction of each trigger, early enough to release the trigger
    in time. paper: the paper's own law, for comparison. paper-isotropic: its printed form, with the same stiffness for
    both. FILE.py: a law of your own (docs/python.md)."""
    compensation: Compensation = "operator"
    """Side that compensates the delay. operator: by the commands still under way. robot: by speed times loop age
    (v t_d, eq. 8)."""
    haptics: bool = True
    """Whether the triggers are stiffened; with --no-haptics the same person only sees."""
    model: Annotated[Path | None, tyro.conf.arg(metavar="FILE.xml")] = None
    """MJCF arm with actuators, instead of the built-in one."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """Site of the model between the fingertips, with the z axis along the approach."""
    site_axis: Literal["x", "-x", "y", "-y", "z", "-z"] = "z"
    """Axis of the site along which R2 advances. The start names the axis that fits the fingers, if another one does."""
    person_file: Annotated[Path | None, tyro.conf.arg(metavar="FILE.py")] = None
    """A person of your own instead of the scripted one (docs/python.md)."""
    realtime: bool = False
    """Ask for real-time scheduling and locked memory for both sides; if that is not permitted, they run as usual."""
    console: bool = True
    """Serve the console, a page for the browser, at an address that is shown. From a terminal on a machine with a
    display the page opens by itself."""
    console_port: Annotated[int, Meta(ge=0, le=65535), tyro.conf.arg(metavar="PORT")] = 0
    """Port of the console's page on this machine; 0: any free port."""
    tui: bool = False
    """Show the state on the full terminal instead of in one line; for machines without a browser."""
    robot_config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """File with more settings for the robot side; feelahead-robot --help lists them."""
    operator_config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """File with more settings for the operator side; feelahead-operator --help lists them."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_limits(self)
        require_law(self.law)
        if self.tui and self.status != "line":
            raise ValueError(f"--tui and --status {self.status} exclude each other; valid: only one of them")
        if self.scene is not None and self.model is not None:
            raise ValueError(
                f"--scene {self.scene} and --model exclude each other, as a model has its own scene; valid: one of them"
            )
        files = {
            "--model": self.model,
            "--person-file": self.person_file,
            "--robot-config": self.robot_config,
            "--operator-config": self.operator_config,
        }
        for flag, path in files.items():
            if path is not None and not path.is_file():
                raise ValueError(f"{flag} {path}: there is no such file; valid: an existing file")
        if (self.model is None) != (self.site is None):
            given, missing = ("--site", "--model") if self.model is None else ("--model", "--site")
            raise ValueError(f"{given} is given without {missing}; valid: both, or neither for the built-in arm")

    @property
    def has_pages(self) -> bool:
        """Whether the console is served, so that pages can be opened."""
        return self.console and not self.tui
