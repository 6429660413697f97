"""What the robot side publishes to be looked at, beside Telemetry: camera frames, and the scene as it believes it is.

    operator ── Watch ──▶ robot                                 control: who looks at what, renewed
    robot ── VideoFrame, VideoStep ──▶ whoever                  view, PUB/SUB, topic `video`
    robot ── SceneShapes, SceneState ──▶ whoever                view, PUB/SUB, topic `scene`

Arrays travel as bytes, little-endian and row by row, as their docstrings say.
"""

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from common.limits import Finite
from common.protocol.messages import Message, Vector3

ViewName = Literal["overview", "first_person"]
VIEW_NAMES: Final[tuple[ViewName, ...]] = ("overview", "first_person")
ShapeKind = Literal["sphere", "box", "cylinder", "capsule", "ellipsoid", "plane", "mesh"]

VIDEO_TOPIC: Final = b"video"
SCENE_TOPIC: Final = b"scene"
_Pixels = Annotated[int, Meta(ge=1, le=4096)]
_POSE_BYTES: Final = 7 * 4
_SPHERE_BYTES: Final = 4 * 4


class VideoFrame(Message, frozen=True, tag="video"):
    """One picture of one camera."""

    view: ViewName
    captured_s: Finite
    """The moment that it shows, on the robot side's monotonic clock."""
    width: _Pixels
    height: _Pixels
    jpeg: bytes


class VideoStep(Message, frozen=True, tag="step"):
    """One picture of one camera in H.264: whole, or the changes since the picture before it."""

    view: ViewName
    captured_s: Finite
    """As VideoFrame's"""
    width: _Pixels
    height: _Pixels
    number: Annotated[int, Meta(ge=1, le=2**63 - 1)]
    """Grows by one from picture to picture of a view"""
    whole: bool
    """Whether it can be shown without any other"""
    h264: bytes
    """An access unit in Annex B's form"""


class Shape(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One solid of a link or an object, in the frame of that."""

    owner: int
    """Which one it belongs to: index into SceneShapes.links or .objects"""
    of_robot: bool
    kind: ShapeKind
    size_m: Vector3
    """box: half sizes; sphere: radius, 0, 0; cylinder, capsule: radius, half length, 0; ellipsoid: half axes; plane:
    half sizes, 0 for endless; mesh: 1, 1, 1"""
    pose: tuple[float, float, float, float, float, float, float]
    """x, y, z and the quaternion w, x, y, z, in the owner's frame"""
    color: tuple[float, float, float, float] = (0.6, 0.6, 0.6, 1.0)
    vertices_m: bytes = b""
    """(v, 3) float32, meshes only"""
    triangles: bytes = b""
    """(t, 3) uint32, meshes only"""


class SceneShapes(Message, frozen=True, tag="shapes"):
    """What there is, in shape: sent anew when somebody begins to look, and every few seconds."""

    version: int
    """Of the links and objects below, which SceneState's indices mean"""
    links: tuple[str, ...]
    objects: tuple[str, ...]
    shapes: tuple[Shape, ...]
    left_out: int = 0
    """Objects that there was no room for; they are felt all the same"""
    object_poses: bytes = b""
    """(objects, 7) float32, rows as in SceneState: where each stands unless SceneState says otherwise; empty where
    SceneState says it of all"""

    def __post_init__(self) -> None:
        if len(self.object_poses) not in (0, _POSE_BYTES * len(self.objects)):
            raise ValueError("object_poses; valid: a row for each of objects, or none")


class EnlargementTerms(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """What eq. 8-10 are made of along one trigger, of the sphere with the largest D_σ."""

    sigma_m: float
    """D_σ (eq. 9-10)"""
    mean_m: float
    """û·(μ_ee - μ_c) + μ_δ"""
    kinematic_sd_m: float
    """√(ûᵀΣû), eq. 5-7"""
    camera_sd_m: float
    prediction_sd_m: float
    """σ_δ"""
    quantile: float
    """Φ⁻¹(P)"""
    loop_age_s: float
    """t_d of eq. 8"""
    displacement_m: float
    """δ by the robot side (eq. 8)"""


class SceneState(Message, frozen=True, tag="scene"):
    """Where everything is, as the robot side believes, and what it makes of it; 30 times a second while watched."""

    version: int
    taken_s: float
    """On the robot side's monotonic clock"""
    link_poses: bytes
    """(n, 7) float32: x, y, z, and the quaternion w, x, y, z of each link"""
    object_index: bytes
    """(k,) uint32: the objects whose poses follow: those that have moved since SceneShapes was made, or may move"""
    object_poses: bytes
    """(k, 7) float32"""
    roles: bytes
    """(objects,) uint8: places in common/roles.py"""
    tool_pose: tuple[float, float, float, float, float, float, float]
    """Of the tool, whose z axis is the approach"""
    spheres: bytes
    """(m, 4) float32: centre and radius of the gripper's spheres and those of what it holds"""
    overlaps: tuple[tuple[int, float, float], ...]
    """(object, by L2, by R2): m³ of the gripper inflated by D_σ and moved by the robot side's δ, where there is any"""
    l2: EnlargementTerms
    r2: EnlargementTerms
    tick_p50_us: float
    tick_p99_us: float
    overruns: int

    def __post_init__(self) -> None:
        if len(self.link_poses) % _POSE_BYTES or len(self.spheres) % _SPHERE_BYTES:
            raise ValueError("link_poses, spheres; valid: whole rows")
        if len(self.object_poses) != _POSE_BYTES * (len(self.object_index) // 4):
            raise ValueError("object_poses; valid: a row for each of object_index")


AnyViewMessage = VideoFrame | VideoStep | SceneShapes | SceneState
