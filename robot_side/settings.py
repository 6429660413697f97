"""Everything about the robot side that a person may set, on the command line or in a TOML file."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from common.command.run_options import SideOptions
from common.limits import check_limits, check_value
from common.roles import Role
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.enlargement.distance import Uncertainty, Vector3
from robot_side.enlargement.prediction_errors import PredictionErrors
from robot_side.laws.named import LawName
from robot_side.operators.safety import SafetySettings
from robot_side.viewing.settings import CamerasSettings

Assist = Literal["none", "speed"]


_Offset = Annotated[float, Meta(ge=-1.0, le=1.0)]
_Spread = Annotated[float, Meta(ge=0.0, le=1.0)]


@dataclass(frozen=True)
class EncoderSettings:
    """The joint encoders' error (eq. 3): assumptions of a usual class, not one arm's specification."""

    sigma_rad: _Spread = 2e-4
    """Standard deviation of a reading's noise."""
    resolution_rad: _Spread = 2.0 * math.pi / 2**15
    """Quantisation step: 15 bits a turn."""

    def __post_init__(self) -> None:
        check_limits(self)


@dataclass(frozen=True)
class CameraSettings:
    """The camera's error of each perceived position, per axis (eq. 1-2); the enlargement knows these figures."""

    mean_m: float | Vector3 = 0.0
    """μ_c, true minus perceived, of every axis of the world or of each."""
    sd_m: _Spread = 0.003
    """Drawn once for each object: 3 mm is a depth camera at half a metre (assumed)."""
    frame_sd_m: _Spread = 0.0
    """Drawn anew in each frame, on top."""

    def __post_init__(self) -> None:
        check_limits(self)
        for mean_m in self.mean_vector_m:
            check_value("mean_m", mean_m, _Offset)

    @property
    def mean_vector_m(self) -> Vector3:
        """μ_c along each axis."""
        return self.mean_m if isinstance(self.mean_m, tuple) else (self.mean_m,) * 3


@dataclass(frozen=True)
class RobotSettings(SideOptions):
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
    model: Annotated[Path | None, tyro.conf.arg(metavar="FILE.xml")] = None
    """Any MJCF arm with actuators instead of the built-in one. It starts at its keyframe named home, else at its first
    keyframe, else in the middle of its joints' ranges."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """The model's site between the fingertips."""
    arm: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Where a driver of an arm of yours connects: that arm moves instead of a simulated one (docs/drivers.md). --model
    says how it is built. With --keys a driver needs a key that is allowed, as an operator does."""
    objects: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Where a process of yours connects that perceives objects, instead of a simulated camera (docs/drivers.md)."""
    scene: SceneName | None = None
    """What the built-in arm stands before. table: a cluttered table, unless given. wall: a wall 10 to 60 mm behind the
    target. slot: two posts on the way, 15 to 40 mm to spare on each side. shelf: a shelf with a raised front edge to
    reach over. The last three are drawn from the seed."""
    law: LawName = "swept"
    """How what is ahead is felt. swept: in time to let go, along each trigger. paper: the paper's plain law, to compare
    with."""
    assist: Assist = "none"
    """What the robot side adds to stiffness, which is advice. speed: it caps the speed along the triggers, so that the
    arm stops where full strength is due, however hard the finger pulls."""
    cover_m: Annotated[float, Meta(ge=0.0005, le=0.05)] = 0.003
    """How far the spheres that cover the gripper may stand out of it: fewer of them for more."""
    prediction_errors: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """What the prediction of the commands under way misses on this arm, from: feelahead bench error --table FILE.toml.
    Known for the built-in arm; without it a fifth of the way that full speed goes in the loop age is added."""
    probability: Annotated[float, tyro.conf.arg(metavar="P")] = 0.99
    """How often a warning must come before the contact, between 0 and 1 (eq. 10). With a camera of 3 mm 0.9
    enlarges the gripper by 4 mm, and 0.99 by 7 mm. An edge nearer than that to the way makes a trigger stiff."""
    permit_tuning: bool = False
    """Let the operator that owns the robot change the probability and this side's emulated link while it runs."""
    assumed_delay_s: Annotated[float, Meta(ge=0.001, le=60.0)] = 1.0
    """The loop age that is reckoned with while none has been measured."""
    kinematic_mean_m: Vector3 = (0.0, 0.0, 0.0)
    """μ_ee, the mean error of the forward kinematics in the world frame, true minus estimated."""
    roles: Annotated[dict[str, Role], tyro.conf.Suppress] = field(default_factory=dict)
    """TOML only: [roles] name = "obstacle", "target", "support" or "ignored"; else the names tell."""
    encoder: EncoderSettings = field(default_factory=EncoderSettings)
    camera: CameraSettings = field(default_factory=CameraSettings)
    cameras: CamerasSettings = field(default_factory=CamerasSettings)
    motion: ToolMotionSettings = field(default_factory=ToolMotionSettings)
    safety: SafetySettings = field(default_factory=SafetySettings)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_limits(self)
        if self.scene is not None and self.model is not None:
            raise ValueError(f"--scene {self.scene} with --model: valid: one of them; a model brings its own scene")
        if self.keys is not None and self.insecure:
            raise ValueError("--insecure with --keys: valid: one of them, as keys already say who may come in")
        self.uncertainty(PredictionErrors())

    def uncertainty(self, prediction: PredictionErrors) -> Uncertainty:
        """What eq. 10 is computed from; ConfigurationError for a probability outside (0, 1)."""
        return Uncertainty(
            probability=self.probability,
            camera_mean_m=self.camera.mean_vector_m,
            camera_sd_m=math.hypot(self.camera.sd_m, self.camera.frame_sd_m),
            kinematic_mean_m=self.kinematic_mean_m,
            prediction=prediction,
        )
