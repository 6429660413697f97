"""Files of clouds: PCD and PLY, as text or binary."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.depth.picture import CameraPose
from robot_side.depth.recorded.cloud import COORDINATES, Cloud, coordinates

_Part = tuple[str, str, int]
"""Field of each point: name, NumPy's type, and how many numbers"""
_PCD_SIZES: Final = {"f": "48", "i": "1248", "u": "1248"}
_PLY_TYPES: Final = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4"},
    **{"double": "f8", "float64": "f8"},
}
_PCD_TYPES: Final = {kind.upper() + size: kind + size for kind, sizes in _PCD_SIZES.items() for size in sizes}
_LONGEST_HEADER: Final = 65536


def read_pcd(path: Path) -> Cloud:
    """Return the cloud of a PCD file; ConfigurationError names the file and the field that is invalid."""
    header, content = _split(path, b"DATA ")
    said = {line.split()[0]: line.split()[1:] for line in header if line.strip() and not line.startswith("#")}
    for name in ("FIELDS", "SIZE", "TYPE", "WIDTH", "HEIGHT"):
        _require(name in said, path, f"{name} is missing", "FIELDS, SIZE, TYPE, WIDTH, HEIGHT and DATA")
    names, counts = said["FIELDS"], said.get("COUNT", ["1"] * len(said["FIELDS"]))
    parts: list[_Part] = []
    for name, kind, size, count in zip(names, said["TYPE"], said["SIZE"], counts, strict=False):
        _require(kind + size in _PCD_TYPES and count.isdigit(), path, f"{name} is {kind} {size} {count}", "F 4 1")
        parts.append((name, _PCD_TYPES[kind + size], int(count)))
    _require(len(parts) == len(names), path, "TYPE, SIZE or COUNT is too short", f"{len(names)} values, as FIELDS has")
    width, height = (_whole(path, name, said[name]) for name in ("WIDTH", "HEIGHT"))
    [form] = said["DATA"][:1] or ["nothing"]
    _require(form in ("ascii", "binary"), path, f"DATA = {form}", "ascii, binary")
    points_m = _points(path, parts, content, width * height, text=form == "ascii")
    viewpoint = _numbers(path, "VIEWPOINT", said.get("VIEWPOINT", ["0", "0", "0", "1", "0", "0", "0"]))
    placed = viewpoint.shape == (7,) and bool(viewpoint[3:].any())
    _require(placed, path, f"VIEWPOINT = {viewpoint}", "x y z qw qx qy qz")
    sensor = CameraPose(viewpoint[:3], Rotation.from_quat(viewpoint[3:], scalar_first=True).as_matrix())
    return Cloud(points_m, (height, width) if height > 1 else None, sensor)


def read_ply(path: Path) -> Cloud:
    """Return the vertices of a PLY file; ConfigurationError names the file and the field that is invalid."""
    header, content = _split(path, b"end_header")
    form, count, parts = "nothing", -1, list[_Part]()
    element = ""
    for words in (line.split() for line in header):
        match words:
            case ["format", said, *_]:
                form = said
            case ["element", "vertex", said]:
                _require(not element, path, f"element {element} is before vertex", "vertex as the first element")
                element, count = "vertex", _whole(path, "element vertex", [said])
            case ["element", said, *_]:
                element = said
            case ["property", kind, *names] if element == "vertex":
                _require(kind in _PLY_TYPES and len(names) == 1, path, f"property {kind}", ", ".join(_PLY_TYPES))
                parts.append((names[0], _PLY_TYPES[kind], 1))
    _require(form in ("ascii", "binary_little_endian"), path, f"format = {form}", "ascii, binary_little_endian")
    _require(count >= 0, path, "element vertex is missing", "a number of vertices")
    return Cloud(_points(path, parts, content, count, text=form == "ascii"))


def _split(path: Path, ends: bytes) -> tuple[list[str], bytes]:
    """Return the lines of the header, up to the one that begins with `ends`, and what follows."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ConfigurationError(f"{path}: {error}; valid: a file that can be read") from error
    start = content.find(b"\n" + ends, 0, _LONGEST_HEADER) + 1
    end = content.find(b"\n", start) + 1
    _require(0 < start < end, path, "the header has no end", f"a line {ends.decode().strip()}")
    return content[:end].decode("ascii", "replace").splitlines(), content[end:]


def _points(path: Path, parts: Sequence[_Part], content: bytes, count: int, *, text: bool) -> FloatArray:
    """Return `count` points (n, 3) of a file whose points have these fields."""
    names = [name for name, _, _ in parts]
    once = all([number for name, _, number in parts if name == wanted] == [1] for wanted in COORDINATES)
    _require(once, path, f"fields = {', '.join(names)}", "x, y and z, each once")
    if not text:
        # Other fields, as padding, may share a name.
        own = [name if name in COORDINATES else f"{k}" for k, name in enumerate(names)]
        fields = zip(own, parts, strict=True)
        dtype = np.dtype([(name, f"<{kind}", (number,)) for name, (_, kind, number) in fields])
        size = dtype.itemsize * count
        _require(len(content) >= size, path, f"{len(content)} bytes of points", f"{size} or more, for {count} points")
        return coordinates(np.frombuffer(content, dtype, count))
    columns = np.cumsum([0, *(number for _, _, number in parts)]).tolist()
    # Other elements may follow the points.
    words = content.split(None, count * columns[-1])[: count * columns[-1]]
    _require(len(words) == count * columns[-1], path, f"{len(words)} numbers of points", f"{count * columns[-1]}")
    wanted = [columns[names.index(name)] for name in COORDINATES]
    return _numbers(path, "x, y, z", [words[column :: columns[-1]] for column in wanted]).T


def _numbers(path: Path, name: str, words: Sequence[str] | Sequence[Sequence[bytes]]) -> FloatArray:
    try:
        return np.array(words, dtype=np.float64)
    except ValueError as error:
        raise ConfigurationError(f"{path}: {name}: {error}; valid: numbers") from error


def _whole(path: Path, name: str, said: Sequence[str]) -> int:
    _require(len(said) == 1 and said[0].isdigit(), path, f"{name} = {' '.join(said)}", "a whole number")
    return int(said[0])


def _require(valid: bool, path: Path, fault: str, remedy: str) -> None:
    if not valid:
        raise ConfigurationError(f"{path}: {fault}; valid: {remedy}")
