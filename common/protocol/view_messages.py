"""View messages besides Telemetry: camera pictures, and the scene as the robot side perceives it.

    operator ── Watch ──▶ robot                                 control: the views that the operator side shows
    robot ── VideoFrame, VideoStep ──▶ viewers                  view, PUB/SUB, topic `video`
    robot ── SceneShapes, SceneState ──▶ viewers                view, PUB/SUB, topic `scene`

Arrays are sent as bytes, little-endian, row by row; the docstrings of the fields give their shapes.
"""

import math
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta

from common.limits import Finite
from common.protocol.messages import Message, Vector3

ViewName = Literal["overview", "first_person"]
VIEW_NAMES: Final[tuple[ViewName, ...]] = ("overview", "first_person")
ShapeKind = Literal["sphere", "box", "cylinder", "capsule", "ellipsoid", "plane", "mesh"]

VIDEO_TOPIC: Final = b"video"
SCENE_TOPIC: Final = b"scene"
_Index = Annotated[int, Meta(ge=0, le=2**31 - 1)]
_Pixels = Annotated[int, Meta(ge=1, le=4096)]
_POSE_BYTES: Final = 7 * 4
_SPHERE_BYTES: Final = 4 * 4
_THREE_BYTES: Final = 3 * 4
"""A vertex, and a triangle"""
_SURFACE_BYTES: Final = 10 * 4


class VideoFrame(Message, frozen=True, tag="video"):
    """One picture of one camera, as JPEG."""

    view: ViewName
    captured_s: Finite
    """Time of capture, on the robot side's monotonic clock."""
    width: _Pixels
    height: _Pixels
    jpeg: bytes


class VideoStep(Message, frozen=True, tag="step"):
    """One picture of one camera, in H.264: either a whole picture, or the changes since the previous one."""

    view: ViewName
    captured_s: Finite
    """Time of capture, on the robot side's monotonic clock"""
    width: _Pixels
    height: _Pixels
    number: Annotated[int, Meta(ge=1, le=2**63 - 1)]
    """Number of the picture among those of its view, which count up by one"""
    whole: bool
    """Whether the picture can be decoded without an earlier one"""
    h264: bytes
    """H.264 access unit in the byte stream format of Annex B"""


class Shape(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """One solid of a link or an object (the owner), in the owner's frame."""

    owner: _Index
    """Index into SceneShapes.links or .objects"""
    of_robot: bool
    kind: ShapeKind
    size_m: Vector3
    """box: half sizes; sphere: radius, 0, 0; cylinder, capsule: radius, half length, 0; ellipsoid: half axes; plane:
    half sizes, 0 for infinite; mesh: 1, 1, 1"""
    pose: tuple[float, float, float, float, float, float, float]
    """Position x, y, z in metres and quaternion w, x, y, z, in the owner's frame"""
    color: tuple[float, float, float, float] = (0.6, 0.6, 0.6, 1.0)
    vertices_m: bytes = b""
    """(v, 3) float32: vertices of a mesh; empty for other kinds"""
    triangles: bytes = b""
    """(t, 3) uint32: vertex indices of a mesh's triangles; empty for other kinds"""

    def __post_init__(self) -> None:
        if not math.isfinite(sum(self.size_m) + sum(self.pose) + sum(self.color)):
            raise ValueError("size_m, pose or color holds NaN or infinity; valid: finite numbers")
        if self.kind == "mesh":
            _require_mesh(self.vertices_m, self.triangles)


class Eye(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Viewpoint of a view: of the first-person view in the tool frame, of the overview in the world's."""

    position_m: Vector3
    forward: Vector3
    """Unit vector"""
    up: Vector3
    """Unit vector, orthogonal to `forward`"""
    fovy_deg: float
    """Angle from the picture's lower edge to its upper one"""
    stretch: float = 1.0
    """How much wider a real camera's picture shows things than high; 1 for square pixels"""
    middle: tuple[float, float] = (0.0, 0.0)
    """Where the picture shows what is straight ahead: right of and above its centre, in half heights"""


class Near(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """What is near the gripper's surface, as perceived; None where unknown."""

    nearest: str | None = None
    """Nearest object, supports and the held one aside"""
    nearest_m: float | None = None
    target_m: float | None = None
    held: str | None = None
    """Object between the fingers"""


class SceneShapes(Message, frozen=True, tag="shapes"):
    """Shapes of the robot's links and of the objects; sent when an operator begins to watch, and every few seconds."""

    version: int
    """Version of the lists below, to which SceneState's indices refer"""
    links: tuple[str, ...]
    objects: tuple[str, ...]
    shapes: tuple[Shape, ...]
    left_out: int = 0
    """Number of objects left out because the message has no room; the law includes them all the same"""
    object_poses: bytes = b""
    """(objects, 7) float32, rows as in SceneState: poses of all objects, for those that SceneState leaves out. Empty if
    SceneState has all of them"""
    eye: Eye | None = None
    """Viewpoint of the first-person view in the tool's frame; None without pictures, and for a real camera whose mount
    or intrinsics are unknown"""
    overview_eye: Eye | None = None
    """Viewpoint of the overview in the world frame; None as for `eye`, and for a camera that moves"""

    def __post_init__(self) -> None:
        if len(self.object_poses) not in (0, _POSE_BYTES * len(self.objects)):
            raise ValueError(
                f"object_poses has {len(self.object_poses)} bytes; valid: {_POSE_BYTES} for each of objects, or 0"
            )


class EnlargementTerms(msgspec.Struct, frozen=True, array_like=True, forbid_unknown_fields=True):
    """Terms of eq. 8-10 along one trigger's direction, for the sphere of the gripper with the largest D_σ."""

    sigma_m: float
    """Enlargement D_σ along the trigger (eq. 9-10)"""
    mean_m: float
    """Mean error along the trigger, û·(μ_ee - μ_c) + μ_δ"""
    kinematic_sd_m: float
    """Standard deviation of the arm's estimate along the trigger, √(ûᵀΣû) (eq. 5-7)"""
    camera_sd_m: float
    """Standard deviation of the camera's error, σ_c, the same in any direction (eq. 1-2)"""
    prediction_sd_m: float
    """Standard deviation of the prediction of δ along the trigger, σ_δ"""
    quantile: float
    """Quantile Φ⁻¹(P) of the standard normal distribution (eq. 10)"""
    loop_age_s: float
    """Loop age t_d that the law assumes (eq. 8)"""
    displacement_m: float
    """Displacement δ along the trigger, as the robot side computes it (eq. 8)"""


class SceneState(Message, frozen=True, tag="scene"):
    """Perceived poses and the law's result, published at 30 Hz while an operator watches the scene."""

    version: int
    taken_s: float
    """Time at which this state held, on the robot side's monotonic clock"""
    link_poses: bytes
    """(n, 7) float32: x, y, z, and the quaternion w, x, y, z of each link"""
    object_index: bytes
    """(k,) uint32: indices into SceneShapes.objects of the objects in `object_poses`: those that may move, or have
    moved since SceneShapes was made"""
    object_poses: bytes
    """(k, 7) float32: x, y, z, and the quaternion w, x, y, z of each object in `object_index`"""
    roles: bytes
    """(objects,) uint8: role of each object, as an index into the roles of common/roles.py"""
    tool_pose: tuple[float, float, float, float, float, float, float]
    """Pose of the tool, whose z axis is the approach axis"""
    spheres: bytes
    """(m, 4) float32: centre and radius of the spheres of the gripper and of the held object"""
    overlaps: tuple[tuple[_Index, float, float], ...]
    """(object index, volume for L2, for R2): what each object shares, in m³, with the union of the gripper's spheres,
    inflated by D_σ and moved by the robot side's δ. Space within several objects counts for one: the volumes add up.
    The index behind the last object's is that of all surfaces. Worked out ten times a second"""
    l2: EnlargementTerms
    r2: EnlargementTerms
    tick_p50_us: float
    tick_p99_us: float
    overruns: int
    near: Near | None = None
    surfaces: bytes | None = None
    """(s, 10) float32: centre, quaternion w, x, y, z and half sizes of the boxes that depth cameras see, which replace
    those of an earlier message; None: they stay. Sent once a second, or less often over a slow link"""
    surface_roles: bytes = b""
    """(s,) uint8: roles of the surfaces, as in `roles`"""
    unseen: tuple[float, float, float, float, float] | None = None
    """Share, 0 to 1, of the space ahead, left, right, above and below the gripper that no depth camera has seen"""

    def __post_init__(self) -> None:
        if len(self.surfaces or b"") != _SURFACE_BYTES * len(self.surface_roles):
            raise ValueError(
                f"surfaces has {len(self.surfaces or b'')} bytes; valid: {_SURFACE_BYTES} for each of surface_roles"
            )
        if len(self.link_poses) % _POSE_BYTES or len(self.spheres) % _SPHERE_BYTES:
            raise ValueError(
                f"link_poses or spheres ends within a row; valid: whole rows of {_POSE_BYTES} and {_SPHERE_BYTES} bytes"
            )
        if 4 * len(self.object_poses) != _POSE_BYTES * len(self.object_index):
            raise ValueError(
                f"object_poses has {len(self.object_poses)} bytes; valid: {_POSE_BYTES} for each entry of object_index"
            )


def _require_mesh(vertices_m: bytes, triangles: bytes) -> None:
    """Raise ValueError unless there are triangles, whole ones, of vertices that are there."""
    if len(vertices_m) % _THREE_BYTES or len(triangles) % _THREE_BYTES or not triangles:
        raise ValueError(
            f"a mesh has {len(vertices_m)} and {len(triangles)} bytes of vertices and triangles; valid: {_THREE_BYTES}"
            " for each, and one or more"
        )
    count, largest = len(vertices_m) // _THREE_BYTES, int(np.frombuffer(triangles, "<u4").max())
    if largest >= count:
        raise ValueError(f"triangles names the vertex {largest}; valid: 0 to {count - 1}")
    if not np.isfinite(np.frombuffer(vertices_m, "<f4")).all():
        raise ValueError("vertices_m holds NaN or infinity; valid: finite positions")


AnyViewMessage = VideoFrame | VideoStep | SceneShapes | SceneState
