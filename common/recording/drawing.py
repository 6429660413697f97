"""Messages of Foxglove's types in a recording: pictures, the scene with its transforms, and the log."""

from typing import Any, Final

import numpy as np
from foxglove import messages

from common.protocol.view_messages import SceneShapes, SceneState, Shape, VideoFrame
from common.recording.mcap_file import RecordingFile

_WORLD: Final = "world"
_POSE: Final = 7


class Drawing:
    """Writer of pictures, scene and log as Foxglove's messages."""

    def __init__(self, file: RecordingFile) -> None:
        self._file = file
        self._drawn: tuple[tuple[str, ...], tuple[str, ...], tuple[Shape, ...]] | None = None
        self._links: tuple[str, ...] = ()
        self._objects: tuple[str, ...] = ()
        self._version: int | None = None

    def log(self, side: str, now_s: float, text: str, *, warning: bool = False) -> None:
        """Write a line that was shown to people, or a warning, to the topic /log."""
        level = messages.LogLevel.Warning if warning else messages.LogLevel.Info
        entry = messages.Log(timestamp=self._stamp(now_s), level=level, message=text, name=side)
        self._file.draw("/log", now_s, entry)

    def image(self, frame: VideoFrame, now_s: float) -> None:
        """Write a camera's picture with its JPEG unchanged."""
        image = messages.CompressedImage(
            timestamp=self._stamp(now_s), frame_id=frame.view, data=frame.jpeg, format="jpeg"
        )
        self._file.draw(f"/camera/{frame.view}", now_s, image)

    def shapes(self, scene: SceneShapes, now_s: float) -> None:
        """Write the shapes of the scene if they have changed."""
        self._links, self._objects, self._version = scene.links, scene.objects, scene.version
        if self._drawn == (scene.links, scene.objects, scene.shapes):
            return
        self._drawn = scene.links, scene.objects, scene.shapes
        groups: dict[str, list[Shape]] = {}
        for shape in scene.shapes:
            groups.setdefault(self._frame(shape.owner, of_robot=shape.of_robot), []).append(shape)
        entities = [self._entity(name, shapes, now_s) for name, shapes in groups.items()]
        clear = messages.SceneEntityDeletion(timestamp=self._stamp(now_s), type=messages.SceneEntityDeletionType.All)
        update = messages.SceneUpdate(deletions=[clear], entities=entities)
        self._file.draw("/scene", now_s, update)

    def state(self, scene: SceneState, now_s: float) -> None:
        """Write the poses of links, objects and tool."""
        if scene.version != self._version:
            return
        stamp = self._stamp(now_s)
        links = np.frombuffer(scene.link_poses, "<f4").reshape(-1, _POSE)
        objects = np.frombuffer(scene.object_poses, "<f4").reshape(-1, _POSE)
        frames = [(self._frame(index, of_robot=True), pose) for index, pose in enumerate(links.tolist())]
        frames += [
            (self._frame(index, of_robot=False), pose)
            for index, pose in zip(np.frombuffer(scene.object_index, "<u4").tolist(), objects.tolist(), strict=True)
        ]
        frames.append(("tool", list(scene.tool_pose)))
        transforms = [
            messages.FrameTransform(
                timestamp=stamp,
                parent_frame_id=_WORLD,
                child_frame_id=name,
                translation=_vector(*pose[:3]),
                rotation=messages.Quaternion(w=pose[3], x=pose[4], y=pose[5], z=pose[6]),
            )
            for name, pose in frames
        ]
        update = messages.FrameTransforms(transforms=transforms)
        self._file.draw("/tf", now_s, update)

    def _frame(self, index: int, *, of_robot: bool) -> str:
        names = self._links if of_robot else self._objects
        return f"{'link' if of_robot else 'object'}/{names[index] if index < len(names) else index}"

    def _entity(self, frame: str, shapes: list[Shape], now_s: float) -> messages.SceneEntity:
        cubes, spheres, cylinders, triangles = [], [], [], []
        for shape in shapes:
            looks: Any = {"pose": _pose(shape), "color": _color(shape)}
            a, b, c = shape.size_m
            match shape.kind:
                case "mesh":
                    triangles.append(_mesh(shape, looks))
                case "box":
                    cubes.append(messages.CubePrimitive(size=_vector(2 * a, 2 * b, 2 * c), **looks))
                case "plane":
                    cubes.append(messages.CubePrimitive(size=_vector(2 * (a or 5.0), 2 * (b or 5.0), 1e-3), **looks))
                case "cylinder" | "capsule":
                    # A capsule's round ends are left out: Foxglove has no such shape.
                    size = _vector(2 * a, 2 * a, 2 * b)
                    cylinders.append(messages.CylinderPrimitive(size=size, bottom_scale=1.0, top_scale=1.0, **looks))
                case "sphere":
                    spheres.append(messages.SpherePrimitive(size=_vector(2 * a, 2 * a, 2 * a), **looks))
                case "ellipsoid":
                    spheres.append(messages.SpherePrimitive(size=_vector(2 * a, 2 * b, 2 * c), **looks))
        return messages.SceneEntity(
            timestamp=self._stamp(now_s),
            frame_id=frame,
            id=frame,
            frame_locked=True,
            cubes=cubes,
            spheres=spheres,
            cylinders=cylinders,
            triangles=triangles,
        )

    def _stamp(self, now_s: float) -> messages.Timestamp:
        seconds, nanoseconds = divmod(self._file.wall_ns(now_s), 10**9)
        return messages.Timestamp(seconds, nanoseconds)


def _vector(x: float, y: float, z: float) -> messages.Vector3:
    return messages.Vector3(x=x, y=y, z=z)


def _pose(shape: Shape) -> messages.Pose:
    x, y, z, *turn = shape.pose
    orientation = messages.Quaternion(w=turn[0], x=turn[1], y=turn[2], z=turn[3])
    return messages.Pose(position=_vector(x, y, z), orientation=orientation)


def _color(shape: Shape) -> messages.Color:
    r, g, b, a = shape.color
    return messages.Color(r=r, g=g, b=b, a=a)


def _mesh(shape: Shape, looks: Any) -> messages.TriangleListPrimitive:
    points = np.frombuffer(shape.vertices_m, "<f4").reshape(-1, 3).tolist()
    return messages.TriangleListPrimitive(
        points=[messages.Point3(x=x, y=y, z=z) for x, y, z in points],
        indices=np.frombuffer(shape.triangles, "<u4").tolist(),
        **looks,
    )
