"""Source of objects that carry printed tags (AprilTag or ArUco), seen by one camera that stands still.

Usage: python tag_objects.py tags.toml [tcp://127.0.0.1:5602]. docs/drivers.md has the file, and what `sd_m` is made of.
It needs opencv-python-headless, scipy, pyzmq and msgspec, and nothing of feelahead.
"""

import contextlib
import itertools
import math
import sys
import time
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

try:
    import cv2
    import numpy as np
    import zmq
    from msgspec import Meta, Struct, convert, msgpack
    from scipy.spatial.transform import Rotation
except ImportError as error:
    print(f"{error}; valid: pip install opencv-python-headless scipy pyzmq msgspec", file=sys.stderr)
    sys.exit(2)

SQUARE = np.array([[-0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [-0.5, -0.5, 0.0]])  # corners as detected
POINTS = np.array([(0, 0, 0), *itertools.product((-1, 1), repeat=3)])  # of a box in half sizes: centre and corners
DOUBT, APART = 16.0, 5.0  # squared noises by which a pose must fit better than one that is so many deviations away
UNSEEN_M_S = 0.02  # how fast an object may move while none of its tags is seen
KINDS = sorted(name for name in dir(cv2.aruco) if name.startswith("DICT_"))
LENSES = 0, 4, 5, 8, 12, 14  # numbers of values of a lens that OpenCV knows

Positive, Three = Annotated[float, Meta(gt=0.0)], tuple[float, float, float]
Quaternion = tuple[float, float, float, float]  # w first


class Tag(Struct, forbid_unknown_fields=True):
    """Tag: its number, the side of its black square, and where it is in the object's frame (x right, y up, z out)."""

    id: int
    side_m: Positive
    position_m: Three = (0.0, 0.0, 0.0)
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)


class Box(Struct, forbid_unknown_fields=True):
    """Object with tags: a box of these half sizes in m."""

    name: str
    box: tuple[Positive, Positive, Positive]
    tags: list[Tag]
    role: str | None = None


class Camera(Struct, forbid_unknown_fields=True, kw_only=True):
    """Camera that stands still: lens as cv2.calibrateCamera finds it, and pose in the world (x right, y down)."""

    source: int | str = 0
    width: int
    height: int
    fx: Positive
    fy: Positive
    cx: float
    cy: float
    distortion: list[float] = []
    position_m: Three
    quaternion: Quaternion
    latency_s: Annotated[float, Meta(ge=0.0)]  # from exposure until `grab` ends
    noise_px: Positive = 0.5
    sd_m: Annotated[float, Meta(ge=0.0)] = 0.003  # how wrong positions are by the camera's pose alone


class File(Struct, forbid_unknown_fields=True):
    """All that the file says; `fixed` are objects without tags, as the protocol has them."""

    dictionary: str
    camera: Camera
    objects: list[Box]
    fixed: list[dict[str, Any]] = []
    most_sd_m: Positive = 0.02  # a place that is known worse, or that two poses tell differently, is left out
    keep_s: Annotated[float, Meta(ge=0.0)] = 0.5  # for how long an object stays after it was seen last


class Tags:
    """Objects with tags, found in pictures; ValueError for a file that is not as it must be."""

    def __init__(self, path: Path) -> None:
        self.file = convert(tomllib.loads(path.read_text(encoding="utf-8")), File)
        if self.file.dictionary not in KINDS:
            raise ValueError(f"dictionary = {self.file.dictionary!r}; valid: {', '.join(KINDS)}")
        finding = cv2.aruco.DetectorParameters()
        finding.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        kind = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.file.dictionary))
        self.detector, of = cv2.aruco.ArucoDetector(kind, finding), self.file.camera
        self.lens = np.array([[of.fx, 0, of.cx], [0, of.fy, of.cy], [0, 0, 1]]), np.array(of.distortion)
        self.turn = Rotation.from_quat(of.quaternion, scalar_first=True)
        self.tags = {tag.id: (box, tag) for box in self.file.objects for tag in box.tags}
        boxes = self.file.objects
        if len(self.tags) < sum(len(box.tags) for box in boxes) or len({box.name for box in boxes}) < len(boxes):
            raise ValueError("objects: an id of tags or a name is there twice; valid: each once")
        if len(of.distortion) not in LENSES:
            raise ValueError(f"camera.distortion has {len(of.distortion)} values; valid: {LENSES}")
        self.kept = dict[str, tuple[dict[str, Any], float]]()

    def objects(self, picture: Any, taken_s: float) -> list[dict[str, Any]]:
        """Return the objects of a picture as the protocol has them; each is placed by the tag that errs least."""
        found, ids, _ = self.detector.detectMarkers(picture)
        numbers, seen = [] if ids is None else np.ravel(ids).tolist(), dict[str, dict[str, Any]]()
        for number, corners in zip(numbers, found, strict=True):
            # A tag that is there twice tells no place.
            if number in self.tags and numbers.count(number) == 1 and (thing := self.place(number, corners[0])):
                seen[thing["name"]] = min(thing, seen.get(thing["name"], thing), key=lambda one: one["sd_m"])
        for name in seen.keys() - self.kept.keys():
            print(f"{name}: seen, sd {1e3 * seen[name]['sd_m']:.0f} mm", flush=True)
        self.kept |= {name: (thing, taken_s) for name, thing in seen.items()}
        for name in [name for name, (_, at_s) in self.kept.items() if taken_s - at_s > self.file.keep_s]:
            print(f"{name}: gone: none of its tags is seen well, or two poses fit", flush=True)
            del self.kept[name]
        grown = ((one, one["sd_m"] + UNSEEN_M_S * (taken_s - at_s)) for one, at_s in self.kept.values())
        return [*self.file.fixed, *(one | {"sd_m": min(math.ceil(1e3 * sd_m) / 1e3, 1.0)} for one, sd_m in grown)]

    def place(self, number: int, corners: Any) -> dict[str, Any] | None:
        """Return the object with tag `number` at these corners (4, 2) in px, None if its place is not known."""
        (box, tag), of, fits = self.tags[number], self.file.camera, []
        square_m, corners = SQUARE * tag.side_m, corners.astype(float)
        into = Rotation.from_quat(tag.quaternion, scalar_first=True).inv()  # from the object's frame to the tag's
        points_m = into.apply(POINTS * box.box - tag.position_m)
        _, turns, ways, _ = cv2.solvePnPGeneric(square_m, corners, *self.lens, flags=cv2.SOLVEPNP_IPPE_SQUARE)
        if len(turns) < 2:
            return None  # these are the corners of no square
        for turn, way in zip(turns, ways, strict=True):
            pixels, slopes = cv2.projectPoints(square_m, turn, way, *self.lens)
            matrix, by = cv2.Rodrigues(turn)
            error = float(np.square(pixels[:, 0] - corners).sum())
            fits.append((error, matrix, points_m @ matrix.T + way.T, by.reshape(3, 3, 3), slopes[:, :6]))
        (error, matrix, at_m, by, slopes), other = sorted(fits, key=lambda fit: fit[0])
        # The corners' noise, carried on to the box's centre and corners: the largest deviation in any direction.
        noise_px = max(of.noise_px, math.sqrt(error / 2.0))  # 8 coordinates less 6 of the pose
        levers = np.einsum("ajk,pk->pja", by, points_m)
        moves = np.concatenate([levers, np.broadcast_to(np.eye(3), levers.shape)], axis=2)
        spread = moves @ np.linalg.inv(slopes.T @ slopes) @ moves.transpose(0, 2, 1)
        sd_m = noise_px * math.sqrt(np.linalg.eigvalsh(spread).max())
        apart_m = np.linalg.norm(other[2] - at_m, axis=1).max()
        if other[0] - error < DOUBT * noise_px**2 or apart_m < APART * sd_m:  # the latter where it is seen straight on
            sd_m = math.hypot(sd_m, apart_m)
        if not sd_m <= self.file.most_sd_m:
            return None
        world = (self.turn * Rotation.from_matrix(matrix) * into).as_quat(scalar_first=True)
        thing = {"name": box.name, "role": box.role, "box": box.box, "sd_m": math.hypot(sd_m, of.sd_m)}
        return thing | {"position_m": (self.turn.apply(at_m[0]) + of.position_m).tolist(), "quaternion": world.tolist()}


def taken(of: Camera) -> Iterator[tuple[Any, float]]:
    """Give a camera's pictures and the times of their exposure; OSError if it gives none, or of another size."""
    (cv2.setLogLevel if hasattr(cv2, "setLogLevel") else cv2.utils.logging.setLogLevel)(0)  # OpenCV 4, and 5
    device = cv2.VideoCapture(of.source)
    device.set(cv2.CAP_PROP_FRAME_WIDTH, of.width)
    device.set(cv2.CAP_PROP_FRAME_HEIGHT, of.height)
    device.set(cv2.CAP_PROP_AUTOFOCUS, 0)  # another focus is another focal length
    while True:
        for _ in range(10):  # a picture that comes at once has waited in a queue, nobody knows how long
            before_s = time.monotonic()
            if not device.grab():
                raise OSError(f"camera: source = {of.source!r} gives no picture; valid: number or address of a camera")
            if (now_s := time.monotonic()) - before_s > 0.002:
                break
        picture = device.retrieve()[1]
        if picture is None or picture.shape[:2] != (of.height, of.width):
            raise OSError(f"camera: pictures are not {of.width} x {of.height}; valid: the size that was calibrated")
        yield picture, now_s - of.latency_s


def main(arguments: list[str], pictures: Iterable[tuple[Any, float]] | None = None) -> int:
    """Send the objects until the pictures end; return the exit code. pictures: with times of exposure, for tests."""
    sequence, echo_s, read_s = 0, None, 0.0
    try:
        tags, socket = Tags(Path(arguments[0] if arguments else "tags.toml")), zmq.Context().socket(zmq.DEALER)
        socket.sndhwm, socket.linger = 2, 0
        socket.connect(arguments[1] if len(arguments) > 1 else "tcp://127.0.0.1:5602")
        for picture, taken_s in pictures or taken(tags.file.camera):
            sequence, objects = sequence + 1, tags.objects(picture, taken_s)
            frame = {"version": 1, "sequence": sequence, "taken_s": taken_s, "objects": objects, "echo_s": echo_s}
            frame |= {"sent_s": (now_s := time.monotonic()), "held_s": 0.0 if echo_s is None else now_s - read_s}
            with contextlib.suppress(zmq.Again):  # no robot side yet
                socket.send(msgpack.encode(frame), zmq.NOBLOCK)
            while socket.poll(5):  # an answer that is read at once bounds the frames' age best
                answer = msgpack.decode(socket.recv())
                if "refused" in answer:
                    print("refused:", answer["refused"], flush=True)
                else:
                    echo_s, read_s = answer["sent_s"], time.monotonic()
    except (OSError, ValueError, zmq.ZMQError) as error:
        print(f"tag_objects: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
