"""Everything about the robot side that a person may set, on the command line or in a TOML file."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from common.command.run_options import RunOptions
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.enlargement.distance import EnlargementSettings
from robot_side.enlargement.kinematic_error import VarianceMeasure
from robot_side.objects.perceived import Role
from robot_side.operators.safety import SafetySettings
from robot_side.stiffness.map import StiffnessSettings
from robot_side.stiffness.predicted_contact import ContactSettings


def _require(name: str, value: float, low: float, high: float) -> None:
    if not (math.isfinite(value) and low <= value <= high):
        raise ValueError(f"{name} = {value}; valid: {low} to {high}")


@dataclass(frozen=True)
class EncoderSettings:
    """The joint encoders' error (eq. 3): assumptions of a usual class, not one arm's specification."""

    sigma_rad: float = 2e-4
    """Standard deviation of a reading's noise."""
    resolution_rad: float = 2.0 * math.pi / 2**15
    """Quantisation step: 15 bits a turn."""

    def __post_init__(self) -> None:
        _require("sigma_rad", self.sigma_rad, 0.0, 1.0)
        _require("resolution_rad", self.resolution_rad, 0.0, 1.0)


@dataclass(frozen=True)
class CameraSettings:
    """The camera's error of each perceived position, per axis (eq. 1-2); the enlargement knows these figures."""

    mean_m: float = 0.0
    sd_m: float = 0.003
    """Drawn once for each object: 3 mm is a depth camera at half a metre (assumed)."""
    frame_sd_m: float = 0.0
    """Drawn anew in each frame, on top."""

    def __post_init__(self) -> None:
        _require("mean_m", self.mean_m, -1.0, 1.0)
        _require("sd_m", self.sd_m, 0.0, 1.0)
        _require("frame_sd_m", self.frame_sd_m, 0.0, 1.0)


@dataclass(frozen=True)
class EnlargementOptions:
    """How the enlargement is worked out (eq. 8-10)."""

    kinematic_mean_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """μ_ee, the mean error of the forward kinematics in the world frame."""
    measure: VarianceMeasure = "isotropic"
    """One variance from Σ: its largest eigenvalue, or the paper's trace."""
    mode: Literal["once", "per_configuration"] = "per_configuration"
    """`once` takes the largest over sampled configurations, as the paper does."""
    direction: Literal["isotropic", "towards_object"] = "isotropic"
    """One distance a sphere (the paper), or one for each sphere and object."""
    fixed_m: float | None = None
    """A fixed enlargement in place of eq. 8-10, to compare with."""


@dataclass(frozen=True)
class RobotSettings(RunOptions):
    """The robot side: a simulated arm that knows how wrong it may be, and warns of what is ahead.

    It listens for an operator side, moves as that one asks while commands keep coming, and answers with the
    stiffness of the two triggers. Any MJCF arm: --model FILE.xml --site NAME, the site between the fingertips
    with its z axis along the approach. A model that holds nothing but the arm gets the built-in table.
    """

    bind: Annotated[str, tyro.conf.arg(metavar="tcp://HOST:PORT")] = "tcp://127.0.0.1:5555"
    """Where to listen for the operator side; port 0 takes any free one."""
    view_bind: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Where to publish what the screen shows; the port after the control port unless given."""
    keys: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Let in only operators whose keys FOLDER allows, and encrypt everything; needed beyond this machine. Made by:
    feelahead keys make robot; then, for each operator: feelahead keys allow NAME KEY."""
    insecure: bool = False
    """Listen beyond this machine without keys: anyone who reaches the port can move the arm."""
    realtime: bool = False
    """Real-time scheduling and locked memory; where that is not permitted, a note says what permits it."""
    model: Annotated[Path | None, tyro.conf.arg(metavar="FILE.xml")] = None
    """Any MJCF arm with actuators instead of the built-in one. It starts at its keyframe named home, else at its first
    keyframe, else in the middle of its joints' ranges."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """The model's site between the fingertips."""
    spheres: int = 16
    """How many spheres cover the gripper."""
    probability: Annotated[float, tyro.conf.arg(metavar="P")] = 0.99
    """How often a warning must come before the contact, between 0 and 1 (eq. 10)."""
    assumed_delay_s: float = 1.0
    """The loop age that eq. 8 takes while none has been measured."""
    roles: Annotated[dict[str, Role], tyro.conf.Suppress] = field(default_factory=dict)
    """TOML only: [roles] name = "obstacle", "target", "support" or "ignored"; else the names tell."""
    encoder: EncoderSettings = field(default_factory=EncoderSettings)
    camera: CameraSettings = field(default_factory=CameraSettings)
    enlargement: EnlargementOptions = field(default_factory=EnlargementOptions)
    stiffness: StiffnessSettings = field(default_factory=StiffnessSettings)
    contact: ContactSettings = field(default_factory=ContactSettings)
    motion: ToolMotionSettings = field(default_factory=ToolMotionSettings)
    safety: SafetySettings = field(default_factory=SafetySettings)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= self.spheres <= 1000:
            raise ValueError(f"--spheres {self.spheres}: valid: 1 to 1000")
        if self.keys is not None and self.insecure:
            raise ValueError("--insecure with --keys: valid: one of them, as keys already say who may come in")
        _require("assumed_delay_s", self.assumed_delay_s, 0.001, 60.0)
        self.enlargement_settings()

    def enlargement_settings(self) -> EnlargementSettings:
        """What eq. 10 is computed from; ConfigurationError for a probability outside (0, 1)."""
        return EnlargementSettings(
            probability=self.probability,
            camera_mean_m=self.camera.mean_m,
            camera_sd_m=math.hypot(self.camera.sd_m, self.camera.frame_sd_m),
            kinematic_mean_m=self.enlargement.kinematic_mean_m,
            measure=self.enlargement.measure,
            mode=self.enlargement.mode,
            direction=self.enlargement.direction,
            fixed_m=self.enlargement.fixed_m,
        )
