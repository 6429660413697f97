"""Encoding and decoding of recorded frames of perceived objects.

    frame   time f64, flags u8 (1: whole, 2: errors, 4: meshes, 8: surfaces, 16: unknown space); if flagged, five f64,
            the shares of unknown space (`common.recording.entries`); then for each array of ARRAYS: tag u8, rows u32,
            and by the tag
              0   nothing: same as in the frame before   1   rows x width values
              2   count u32, count row numbers u32, count x width values: these rows, the others as before
              3   nothing: the array is None
            errors, if flagged: sds_m as such an array, unseen_m f64, late_s f64
            surfaces, if flagged, as such an array; boxes of unknown space, if flagged, too
            meshes, if flagged: length u32 and MessagePack: vertices and triangles of each mesh that was sent
            names: length u32 and MessagePack, in whole frames only; roles: one u8 an object

Values are float64 or int64, bit for bit as the core got them.
"""

import math
import struct
from collections.abc import Mapping
from typing import Any, Final

import msgspec
import numpy as np

from common.recording.entries import FRAME, HAS_UNKNOWN, SHARES
from common.roles import Role
from robot_side.surroundings.perceived import KINDS, PerceivedObjects, UnknownSpace, library_of

ARRAYS: Final[Mapping[str, tuple[type, tuple[int, ...]]]] = {
    name: described
    for kind in KINDS
    for name, described in (
        *((array.name, (array.type, array.row)) for array in kind.arrays),
        (kind.owner, (np.int64, ())),
    )
} | {"velocities_m_s": (np.float64, (3,))}
"""Arrays of a frame in their order, with the type of their values and the shape of a row"""
_SAME, _WHOLE, _ROWS, _NONE = range(4)
_IS_WHOLE, _HAS_ERRORS, _HAS_MESHES, _HAS_SURFACES = 1, 2, 4, 8
_UNSEEN: Final = struct.Struct("<dd")
_LENGTH: Final = struct.Struct("<I")
_ARRAY: Final = struct.Struct("<BI")
_ROLES: Final = tuple(Role)


class FramePacker:
    """Encoder of frames by their changes, as most objects stand still."""

    def __init__(self) -> None:
        self._last: PerceivedObjects | None = None

    def begin_epoch(self) -> None:
        """Encode the next frame as a whole, not by its changes."""
        self._last = None

    def pack(self, frame: PerceivedObjects) -> bytes:
        """Encode a frame."""
        last, self._last = self._last, frame
        if last is not None and last.names is not frame.names and last.names != frame.names:
            last = None
        sources = () if frame.mesh_library is None else frame.mesh_library.sources
        if last is not None and last.mesh_library is frame.mesh_library:
            sources = ()
        errs = frame.sds_m is not None or frame.unseen_m > 0.0 or frame.late_s > 0.0
        flags = (last is None) * _IS_WHOLE | errs * _HAS_ERRORS | bool(sources) * _HAS_MESHES
        flags |= (frame.surfaces is not None) * _HAS_SURFACES
        flags |= (frame.unknown is not None) * HAS_UNKNOWN
        parts = [FRAME.pack(frame.time_s, flags)]
        if frame.unknown is not None:
            parts.append(SHARES.pack(*frame.unknown.shares))
        for name in ARRAYS:
            parts += _packed(getattr(frame, name), None if last is None else getattr(last, name))
        if errs:
            parts += _packed(frame.sds_m, None if last is None else last.sds_m)
            parts.append(_UNSEEN.pack(frame.unseen_m, frame.late_s))
        if frame.surfaces is not None:
            parts += _packed(frame.surfaces, None if last is None else last.surfaces)
        if frame.unknown is not None:
            before = None if last is None or last.unknown is None else last.unknown.boxes_m
            parts += _packed(frame.unknown.boxes_m, before)
        for content in ([sources] if sources else []) + ([frame.names] if last is None else []):
            packed = msgspec.msgpack.encode(content)
            parts += [_LENGTH.pack(len(packed)), packed]
        parts.append(bytes(_ROLES.index(role) for role in frame.roles))
        return b"".join(parts)


def _packed(values: Any, last: Any) -> list[bytes]:
    if values is None:
        return [_ARRAY.pack(_NONE, 0)]
    rows = len(values)
    if last is None or last.shape != values.shape:
        return [_ARRAY.pack(_WHOLE, rows), values.tobytes()]
    if rows == 0:
        return [_ARRAY.pack(_SAME, 0)]
    # Compare bits: NaN equals itself, and 0 differs from -0.
    bits, before = (np.ascontiguousarray(array).view(np.int64).reshape(rows, -1) for array in (values, last))
    changed = np.flatnonzero((bits != before).any(axis=1)).astype("<u4")
    if len(changed) == 0:
        return [_ARRAY.pack(_SAME, rows)]
    if 2 * len(changed) > rows:
        return [_ARRAY.pack(_WHOLE, rows), values.tobytes()]
    return [_ARRAY.pack(_ROWS, rows), struct.pack("<I", len(changed)), changed.tobytes(), values[changed].tobytes()]


class FrameUnpacker:
    """Decoder of frames from their changes."""

    def __init__(self, scene: PerceivedObjects) -> None:
        """scene: any frame of the same scene; it has the shapes of the model's meshes, which are not recorded.

        Frames without these may have other objects.
        """
        self._scene = scene
        self._last: PerceivedObjects | None = None

    def unpack(self, content: bytes) -> PerceivedObjects:
        """Decode a frame; ValueError or struct.error for invalid content, or for changes without the frame before."""
        time_s, flags = FRAME.unpack_from(content)
        whole = flags & _IS_WHOLE
        if not whole and self._last is None:
            raise ValueError("the frame holds only changes, but no complete frame came before it")
        last, position = None if whole else self._last, FRAME.size
        shares = SHARES.unpack_from(content, position) if flags & HAS_UNKNOWN else None
        position += 0 if shares is None else SHARES.size
        arrays: dict[str, Any] = {}
        for name, (kind, shape) in ARRAYS.items():
            arrays[name], position = _unpacked(
                content, position, kind, shape, None if last is None else getattr(last, name)
            )
        if flags & _HAS_ERRORS:
            before = None if last is None else last.sds_m
            arrays["sds_m"], position = _unpacked(content, position, np.float64, (), before)
            arrays["unseen_m"], arrays["late_s"] = _UNSEEN.unpack_from(content, position)
            position += _UNSEEN.size
        if flags & _HAS_SURFACES:
            arrays["surfaces"], position = _unpacked(
                content, position, np.int64, (), None if last is None else last.surfaces
            )
        if shares is not None:
            before = None if last is None or last.unknown is None else last.unknown.boxes_m
            boxes_m, position = _unpacked(content, position, np.float64, (2, 3), before)
            ahead, left, right, up, down = shares
            arrays["unknown"] = UnknownSpace(ahead, left, right, up, down, boxes_m)
        library = None if last is None else last.mesh_library
        if flags & _HAS_MESHES:
            sources, position = _content(content, position, tuple[tuple[bytes, bytes], ...])
            library = library_of(sources)
        names, position = (last.names, position) if last is not None else _content(content, position, tuple[str, ...])
        if library is None:
            others = names != self._scene.names
            meshed = {names[thing].rstrip("!") for thing in arrays["mesh_object"].tolist()}
            if meshed and meshed <= set(self._scene.names):
                others = False
            elif others and meshed:
                raise ValueError("the frame has other objects than the scene")
            library = None if others else self._scene.mesh_library
        roles = tuple(_ROLES[role] for role in content[position:])
        if len(roles) != len(names):
            raise ValueError(f"the frame has {len(roles)} roles; valid: one for each of {len(names)} objects")
        self._last = PerceivedObjects(time_s=time_s, names=names, roles=roles, mesh_library=library, **arrays)
        return self._last


def _content(content: bytes, position: int, kind: Any) -> tuple[Any, int]:
    """Return what MessagePack of a given length holds, and the position after it."""
    (length,) = _LENGTH.unpack_from(content, position)
    begin = position + _LENGTH.size
    return msgspec.msgpack.decode(content[begin : begin + length], type=kind), begin + length


def _unpacked(content: bytes, position: int, kind: type, shape: tuple[int, ...], last: Any) -> tuple[Any, int]:
    tag, rows = _ARRAY.unpack_from(content, position)
    position += _ARRAY.size
    if tag == _NONE:
        return None, position
    width = math.prod(shape)
    if tag == _WHOLE:
        values = np.frombuffer(content, kind, rows * width, position).reshape(rows, *shape).copy()
        return values, position + values.nbytes
    if last is None or len(last) != rows:
        raise ValueError("the frame's changes do not fit the frame before it")
    if tag == _SAME:
        return last, position
    (count,) = struct.unpack_from("<I", content, position)
    changed = np.frombuffer(content, "<u4", count, position + 4)
    position += 4 + 4 * count
    values = last.copy()
    values[changed] = np.frombuffer(content, kind, count * width, position).reshape(count, *shape)
    return values, position + 8 * count * width
