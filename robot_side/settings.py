"""Settings of the robot side, from the command line or a TOML file."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import tyro
from msgspec import Meta

from common.command.run_options import SideOptions
from common.files.plugged import require_name
from common.limits import check_limits, check_value
from common.roles import Role
from robot_side.arm.bounds import Bounds, KeepOut, Workspace
from robot_side.arm.limits import ArmLimits
from robot_side.arm.tool_motion import ToolMotionSettings
from robot_side.depth.camera_settings import BY_DEPTH, DepthCameraSettings, LinkMount
from robot_side.depth.settings import MapSettings
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.drivers.mujoco.robot_model import SiteAxis
from robot_side.enlargement.distance import Uncertainty, Vector3
from robot_side.enlargement.prediction_errors import BUILT_IN, PredictionErrors, load_prediction_errors
from robot_side.laws.named import require_law
from robot_side.laws.paper_settings import PaperFlags
from robot_side.operators.safety import SafetySettings
from robot_side.viewing.settings import CamerasSettings

Assist = Literal["none", "speed"]


_Offset = Annotated[float, Meta(ge=-1.0, le=1.0)]
_Spread = Annotated[float, Meta(ge=0.0, le=1.0)]


@dataclass(frozen=True)
class EncoderSettings:
    """Error of the joint encoders (eq. 3); the defaults are assumed for a usual class of encoders, not one arm."""

    sigma_rad: _Spread = 2e-4
    """Standard deviation of a reading's noise."""
    resolution_rad: _Spread = 2.0 * math.pi / 2**15
    """Quantisation step of a reading; the default is 15 bits a revolution."""

    def __post_init__(self) -> None:
        check_limits(self)


@dataclass(frozen=True)
class CameraSettings:
    """Error of the camera's perceived positions along each axis (eq. 1-2); the enlargement uses these values."""

    mean_m: float | Vector3 = 0.0
    """Mean error μ_c, true minus perceived position: one value for all axes of the world, or three."""
    sd_m: _Spread = 0.003
    """Standard deviation of an error drawn once for each object; 3 mm is assumed for a depth camera at half a metre."""
    frame_sd_m: _Spread = 0.0
    """Standard deviation of an additional error, drawn anew in each frame."""
    unseen_m_s: Annotated[float, Meta(ge=0.0, le=10.0)] = 0.02
    """With --objects: speed at which anything may move without being seen to; the enlargement grows by it with the age
    of the newest frame."""

    def __post_init__(self) -> None:
        check_limits(self)
        for mean_m in self.mean_vector_m:
            check_value("mean_m", mean_m, _Offset)

    @property
    def mean_vector_m(self) -> Vector3:
        """Mean error μ_c of an object's perceived position along each axis, in metres."""
        return self.mean_m if isinstance(self.mean_m, tuple) else (self.mean_m,) * 3


@dataclass(frozen=True)
class RobotSettings(PaperFlags, SideOptions):
    """Robot side: a simulated arm that warns of contact ahead and allows for its own measurement errors.

    It listens for an operator side, moves while commands keep coming, and answers with the stiffness of the two
    triggers. For any MJCF arm give --model FILE.xml --site NAME. The site is between the fingertips, and its z axis is
    along the approach. A model of the arm alone gets the built-in table.
    """

    bind: Annotated[str, tyro.conf.arg(metavar="tcp://HOST:PORT")] = "tcp://127.0.0.1:5555"
    """Address at which to listen for the operator side; port 0 takes any free port."""
    view_bind: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Address at which to publish the views; by default the port after the control port."""
    keys: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Admit only operators whose keys FOLDER allows, and encrypt everything; needed for connections beyond this
    machine. To make FOLDER: feelahead keys make robot; then, for each operator: feelahead keys allow NAME KEY."""
    audit: Annotated[Path | None, tyro.conf.arg(metavar="FILE.jsonl")] = None
    """Add to this file who connected, armed, was refused, revoked or cut off, and when; one JSON object a line. At 1 MB
    it is put aside as FILE.jsonl.1; eight are kept."""
    insecure: bool = False
    """Listen for other machines without keys: anyone who reaches the port can move the arm."""
    model: Annotated[Path | None, tyro.conf.arg(metavar="FILE.xml")] = None
    """MJCF file of any arm with actuators, instead of the built-in arm. It starts at the keyframe named home, else at
    the first keyframe, else in the middle of the joints' ranges."""
    site: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """Name of the model's site between the fingertips."""
    site_axis: SiteAxis = "z"
    """Axis of the site along which R2 advances. The start names the axis that fits the fingers, if another one does."""
    arm: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Address at which the driver of your arm connects; that arm moves instead of a simulated one (docs/drivers.md).
    --model describes the arm. With --keys the driver needs an allowed key, as an operator does. In a TOML file it is
    the key address of the table [arm], if that has other keys."""
    arm_limits: ArmLimits = field(default_factory=ArmLimits)
    """Limits of the arm's joints; the table [arm.limits] of a TOML file. Those that a driver says count where these are
    not given."""
    arm_workspace: Annotated[Workspace | None, tyro.conf.Suppress] = None
    """Only in a TOML file: [arm.workspace] lower_m and upper_m, corners of a box in the world frame. The tool's point
    stays in it, and its sides are felt as walls."""
    arm_keep_out: Annotated[tuple[KeepOut, ...], tyro.conf.Suppress] = ()
    """Only in a TOML file: [[arm.keep_out]] center_m, half_sizes_m and quaternion of a box, which is perceived as an
    obstacle whatever a camera sees."""
    arm_fastest_m_s: Annotated[float, Meta(gt=0.0, le=5.0)] | None = None
    """Greatest speed of the tool's point, for all motion together; none unless given. In a TOML file: [arm]
    fastest_m_s."""
    simulated_limits: Annotated[ArmLimits | None, tyro.conf.Suppress] = None
    """Only in a TOML file: limits of the simulated arm that [arm.limits] does not know, for experiments."""
    measure_limits: Annotated[Literal["ask", "yes"] | None, tyro.conf.arg(metavar="[yes]")] = None
    """Measure what the arm really does, print the lines of [arm.limits], and end, without an operator. Each joint moves
    a little, back and forth (docs/real-arm.md). A person is asked before, unless yes is given."""
    measure_room_rad: Annotated[float, tyro.conf.arg(metavar="RAD"), Meta(ge=0.1, le=3.0)] = 0.35
    """Largest motion of a joint while its limits are measured; a seventh of it in m where it slides."""
    objects: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Address at which your perception process connects, instead of a simulated camera (docs/drivers.md)."""
    pictures: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Address at which your camera process connects (docs/drivers.md). The views that it sends replace the simulated
    ones."""
    perception: Annotated[str | None, tyro.conf.arg(metavar="depth|NAME|FILE.py")] = None
    """What perceives objects in the simulation. depth: simulated depth cameras, which see surfaces that nobody modelled
    (docs/depth.md). Or perception of your own in this process: a function that gets the simulated camera and returns
    the one to use (docs/python.md)."""
    depth: Annotated[str | None, tyro.conf.arg(metavar="tcp://HOST:PORT")] = None
    """Address at which your depth cameras' process connects (docs/depth.md)."""
    scene: Annotated[SceneName | None, tyro.conf.arg(metavar="{table,wall,slot,shelf}")] = None
    """Scene of the built-in arm. table (the default): a cluttered table. wall: a wall 10 to 60 mm behind the target.
    slot: two posts on the way, with 15 to 40 mm of clearance on each side. shelf: a shelf with a raised front edge to
    reach over. The last three are drawn from the seed."""
    law: Annotated[str, tyro.conf.arg(metavar="NAME|FILE.py")] = "swept"
    """Law from which stiffness follows. swept: stiffness along the direction of each trigger, early enough to release
    the trigger in time. paper: the paper's own law, for comparison. paper-isotropic: its printed form, with the same
    stiffness for both triggers. margin: the same at a fixed distance. FILE.py: a law of your own (docs/python.md)."""
    assist: Assist = "none"
    """Help besides stiffness, which a strong finger can overcome. speed: the robot side limits the speed along the
    triggers, so that the arm stops where full strength is due, however hard the finger pulls."""
    cover_m: Annotated[float, Meta(ge=0.0005, le=0.05)] = 0.003
    """Largest distance by which spheres that cover the gripper may protrude; a larger distance needs fewer spheres."""
    prediction_errors: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """Errors of the predicted motion by commands under way on this arm, as written by: feelahead bench error --table
    FILE.toml. They are known for the built-in arm. For another arm without this file, a fifth of the distance at full
    speed in the loop age is added."""
    probability: Annotated[float, tyro.conf.arg(metavar="P")] = 0.99
    """Share of approaches in which the warning must come before the contact, between 0 and 1 (eq. 10). With a camera
    error of 3 mm, 0.9 enlarges the gripper by 4 mm and 0.99 by 7 mm. An edge that is nearer than this to the gripper's
    path makes a trigger stiff."""
    permit_tuning: bool = False
    """Let the owner of the lease change the probability and the emulated link of this side during the run."""
    assumed_delay_s: Annotated[float, Meta(ge=0.001, le=60.0)] = 1.0
    """Loop age assumed until one has been measured."""
    kinematic_mean_m: Vector3 = (0.0, 0.0, 0.0)
    """Mean error μ_ee of the forward kinematics in the world frame, true minus estimated position."""
    roles: Annotated[dict[str, Role], tyro.conf.Suppress] = field(default_factory=dict)
    """Only in a TOML file: [roles] NAME = "obstacle", "target", "support" or "ignored"; by default by the names."""
    encoder: EncoderSettings = field(default_factory=EncoderSettings)
    camera: CameraSettings = field(default_factory=CameraSettings)
    depth_camera: DepthCameraSettings = field(default_factory=DepthCameraSettings)
    depth_map: MapSettings = field(default_factory=MapSettings)
    depth_mounts: Annotated[dict[str, LinkMount], tyro.conf.Suppress] = field(default_factory=dict)
    """Only in a TOML file: [depth.mounts.NAME], by the names of the cameras that send pictures to --depth."""
    cameras: CamerasSettings = field(default_factory=CamerasSettings)
    motion: ToolMotionSettings = field(default_factory=ToolMotionSettings)
    safety: SafetySettings = field(default_factory=SafetySettings)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_limits(self)
        if self.scene is not None and self.model is not None:
            raise ValueError(
                f"--scene {self.scene} and --model exclude each other, as a model has its own scene; valid: one of them"
            )
        if self.keys is not None and self.insecure:
            raise ValueError(
                "--insecure and --keys exclude each other, as keys decide who may connect; valid: only one of them"
            )
        if self.pictures is not None and not self.cameras.on:
            raise ValueError("--pictures and --no-cameras exclude each other; valid: one of them")
        require_law(self.law)
        if self.depth_map.unseen == "half" and self.law != "swept":
            raise ValueError(f"--depth-map.unseen half and --law {self.law} exclude each other; valid: --law swept")
        if self.perception is not None:
            require_name("perception", self.perception, (BY_DEPTH,))
        sources = [f"--{name}" for name in ("perception", "objects", "depth") if getattr(self, name) is not None]
        if len(sources) > 1 and sources != ["--objects", "--depth"]:
            valid = "valid: one of them, or --objects and --depth"
            raise ValueError(f"{' and '.join(sources)} exclude each other; {valid}")
        self.uncertainty(PredictionErrors())

    @property
    def by_depth(self) -> bool:
        """Whether depth cameras perceive the objects"""
        return self.depth is not None or self.perception == BY_DEPTH

    @property
    def sees_any(self) -> bool:
        """Whether objects of any kind may appear: sent ones, or surfaces that depth cameras see"""
        return self.objects is not None or self.by_depth

    @property
    def simulates_all(self) -> bool:
        """Whether arm and objects are simulated, however they are perceived"""
        return self.arm is None and self.objects is None and self.depth is None

    @property
    def workspace_m(self) -> tuple[Vector3, Vector3] | None:
        """Lower and upper corner of the workspace; None without one"""
        sides = self.arm_workspace
        return None if sides is None else (sides.lower_m, sides.upper_m)

    @property
    def bounds(self) -> Bounds | None:
        """Bounds of the tool's motion; None without any"""
        found = Bounds(self.arm_workspace, self.arm_fastest_m_s)
        return None if found == Bounds() else found

    @property
    def capped_motion(self) -> ToolMotionSettings:
        """The tool's speeds at full travel and deflection, none above `arm_fastest_m_s`"""
        fastest_m_s, motion = self.arm_fastest_m_s or math.inf, self.motion
        return replace(
            motion,
            trigger_speed_m_s=min(motion.trigger_speed_m_s, fastest_m_s),
            stick_speed_m_s=min(motion.stick_speed_m_s, fastest_m_s),
        )

    def uncertainty(self, prediction: PredictionErrors) -> Uncertainty:
        """Return the inputs of eq. 9-10; ConfigurationError for a probability outside (0, 1)."""
        return Uncertainty(
            probability=self.probability,
            camera_mean_m=self.camera.mean_vector_m,
            camera_sd_m=math.hypot(self.camera.sd_m, self.camera.frame_sd_m),
            kinematic_mean_m=self.kinematic_mean_m,
            prediction=prediction,
        )

    def prediction_for(self, arm: str) -> tuple[PredictionErrors, tuple[str, ...]]:
        """Return the prediction errors of the arm with this fingerprint, and a note if they have not been measured."""
        if self.prediction_errors is not None:
            return load_prediction_errors(self.prediction_errors), ()
        built_in = load_prediction_errors(BUILT_IN)
        # Measured in the simulation: a real arm of the same model may move differently.
        if built_in.arm == arm and self.arm is None:
            return built_in, ()
        note = (
            "the prediction error of the commands under way has not been measured on this arm: a fifth of the distance"
            " at full speed in the loop age is added (to measure it: feelahead bench error --table FILE.toml, then"
            " --prediction-errors FILE.toml)"
        )
        return PredictionErrors(), (note,)
