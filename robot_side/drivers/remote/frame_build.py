"""Building of a frame of objects from its message, some objects at a time, so that no turn is held up."""

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from common.arrays import FloatArray, IntArray
from common.roles import Role
from robot_side.drivers.remote.frame_message import ObjectFrame, SeenObject, read_object
from robot_side.surroundings.perceived import KINDS, PerceivedObjects

if TYPE_CHECKING:
    from robot_side.overlap.meshes.mesh_library import MeshLibrary

AT_ONCE: Final = 64
"""Number of objects, and of tetrahedra, that one step reads"""
_NONE: Final = (0.0, 0.0, 0.0)

Arrays = dict[str, Any]


class ReadObjects(NamedTuple):
    """Objects of a message (k), in its order, with their primitives."""

    names: list[str]
    roles: list[Role | None]
    positions_m: FloatArray
    rotations: FloatArray
    velocities_m_s: FloatArray
    measured: bool
    """Whether any object has a velocity"""
    sds_m: FloatArray
    parts: Arrays
    """Arrays of a frame; owners are indices into `names`"""
    meshes: list[str]
    """Name of each mesh in `parts`"""


def read_in_steps(frame: ObjectFrame) -> Iterator[ReadObjects | None]:
    """Yield None after each step, at last the objects; ValueError or RemoteProtocolError for an invalid object."""
    pieces, numbers, names = list[ReadObjects](), iter(range(len(frame.objects))), set[str]()
    while numbered := list(_some(frame, numbers)):
        things = [thing for _, thing in numbered]
        for thing in things:
            if thing.name in names:
                raise ValueError(f"{thing.name!r} occurs more than once; valid: once")
            names.add(thing.name)
        pieces.append(_read(things, numbered[0][0]))
        if len(names) < len(frame.objects):
            yield None
    yield _joined(pieces or [_read([], 0)])


def perceived(
    things: Sequence[SeenObject], roles: Sequence[Role], time_s: float, library: "MeshLibrary | None" = None
) -> PerceivedObjects:
    """Return a frame with these valid objects in these roles. library: its first mesh is that of all."""
    read = _read(things, 0)
    shapes = {"mesh_library": library, "mesh_index": np.zeros(len(read.meshes), dtype=np.int64)}
    of_names = dict(zip(read.names, roles, strict=True))
    return Known(len(things)).frame(read, 0, lambda name, _: of_names[name], time_s, shapes)


def _some(frame: ObjectFrame, numbers: Iterator[int]) -> Iterator[tuple[int, SeenObject]]:
    """Read the next objects, as many as one step takes."""
    load = 0
    for number in islice(numbers, AT_ONCE):
        thing = read_object(frame, number)
        yield number, thing
        load += 1 + len(thing.tetrahedra or ())
        if load >= AT_ONCE:
            return


def _read(things: Sequence[SeenObject], first: int) -> ReadObjects:
    """Return these objects; `first` is the index of the first."""
    quaternions = np.array([thing.quaternion for thing in things]).reshape(-1, 4)
    turned = Rotation.from_quat(quaternions, scalar_first=True).as_matrix() if things else np.empty((0, 3, 3))
    # The known mean error is corrected.
    positions = _rows([thing.position_m for thing in things]) + _rows([thing.mean_m for thing in things])
    parts: Arrays = {}
    meshes: list[str] = []
    spheres = _which(things, "sphere")
    parts["sphere_centers_m"] = positions[spheres]
    parts["sphere_radii_m"] = np.array([things[k].sphere for k in spheres], dtype=np.float64)
    for kind, place, sizes in (("box", "centers", "half_sizes_m"), ("ellipsoid", "centers", "half_axes_m")):
        mine = _which(things, kind)
        parts[f"{kind}_{place}_m"], parts[f"{kind}_rotations"] = positions[mine], turned[mine]
        parts[f"{kind}_{sizes}"] = _rows([getattr(things[k], kind) for k in mine])
        parts[f"{kind}_object"] = mine + first
    fours = _which(things, "tetrahedra")
    corners = [np.array(things[k].tetrahedra) @ turned[k].T + positions[k] for k in fours]
    parts["tetrahedron_vertices_m"] = np.concatenate([np.empty((0, 4, 3)), *corners])
    parts["tetrahedron_object"] = np.repeat(fours, [len(some) for some in corners]) + first
    halves = _which(things, "half_space")
    normals = turned[halves, :, 2]
    normals = normals / np.sqrt(np.einsum("pi,pi->p", normals, normals))[:, None]
    parts["half_space_normals"] = normals
    parts["half_space_offsets_m"] = np.einsum("pi,pi->p", normals, positions[halves])
    placed = _which(things, "mesh")
    parts["mesh_positions_m"], parts["mesh_rotations"] = positions[placed], turned[placed]
    meshes = [str(things[k].mesh) for k in placed]
    parts |= {"sphere_object": spheres + first, "half_space_object": halves + first, "mesh_object": placed + first}
    return ReadObjects(
        names=[thing.name for thing in things],
        roles=[thing.role for thing in things],
        positions_m=positions,
        rotations=turned,
        velocities_m_s=_rows([thing.velocity_m_s or _NONE for thing in things]),
        measured=any(thing.velocity_m_s is not None for thing in things),
        sds_m=np.array([np.nan if thing.sd_m is None else thing.sd_m for thing in things], dtype=np.float64),
        parts=parts,
        meshes=meshes,
    )


def _joined(pieces: Sequence[ReadObjects]) -> ReadObjects:
    first, *others = pieces
    if not others:
        return first
    return ReadObjects(
        names=[name for piece in pieces for name in piece.names],
        roles=[role for piece in pieces for role in piece.roles],
        positions_m=np.concatenate([piece.positions_m for piece in pieces]),
        rotations=np.concatenate([piece.rotations for piece in pieces]),
        velocities_m_s=np.concatenate([piece.velocities_m_s for piece in pieces]),
        measured=any(piece.measured for piece in pieces),
        sds_m=np.concatenate([piece.sds_m for piece in pieces]),
        parts={name: np.concatenate([piece.parts[name] for piece in pieces]) for name in first.parts},
        meshes=[name for piece in pieces for name in piece.meshes],
    )


class Known:
    """Objects that have been seen, each at its index in the frames."""

    def __init__(self, most: int) -> None:
        """most: maximum number of names."""
        self.names: tuple[str, ...] = ()
        self.roles: tuple[Role, ...] = ()
        self._most = most
        self._sent: list[str] = []
        self._places: IntArray = np.empty(0, dtype=np.int64)
        self._index: dict[str, int] = {}
        self._last_seen: IntArray = np.empty(0, dtype=np.int64)
        """Number of the frame that had each object last"""
        self._positions_m: FloatArray = np.empty((0, 3))
        self._rotations: FloatArray = np.empty((0, 3, 3))

    def frame(
        self, read: ReadObjects, number: int, role: Callable[[str, Role | None], Role], time_s: float, meshes: Arrays
    ) -> PerceivedObjects:
        """Return the frame with these objects and those that are gone. role: of an object by name and as sent.

        A missing object has no shape but keeps its name and index, as it may be held. If there is no room, a new object
        takes the index of the one that has been gone longest, whose name is forgotten. number: rises with each frame.
        meshes: the fields of meshes that `read` lacks.
        """
        places = self._placed(read.names)
        count = len(self.names)
        self._last_seen[places], self._positions_m[places], self._rotations[places] = (
            number,
            read.positions_m,
            read.rotations,
        )
        roles = [Role.IGNORED] * count
        for name, place, sent in zip(read.names, places.tolist(), read.roles, strict=True):
            roles[place] = role(name, sent)
        if tuple(roles) != self.roles:
            self.roles = tuple(roles)
        velocities = sds = None
        if read.measured:
            velocities = np.zeros((count, 3))
            velocities[places] = read.velocities_m_s
        if not np.isnan(read.sds_m).all():
            sds = np.full(count, np.nan)
            sds[places] = read.sds_m
        felt = np.array([one is not Role.IGNORED for one in roles], dtype=np.bool_)
        arrays = _of_felt(read.parts | meshes, places, felt)
        return PerceivedObjects(
            time_s=time_s,
            names=self.names,
            roles=self.roles,
            positions_m=self._positions_m.copy(),
            rotations=self._rotations.copy(),
            velocities_m_s=velocities,
            sds_m=sds,
            **arrays,
        )

    def _placed(self, sent: list[str]) -> IntArray:
        """Return the index of each of these names, which become known."""
        if sent == self._sent:
            return self._places
        names, index = list(self.names), dict(self._index)
        new = [name for name in sent if name not in index]
        room = max(self._most - len(names), 0)
        if len(new) > room:
            present = set(sent)
            gone = [place for place, name in enumerate(names) if name not in present]
            gone.sort(key=self._last_seen.__getitem__)
            for place, name in zip(gone, new[room:], strict=False):
                del index[names[place]]
                names[place], index[name] = name, place
        for name in new[:room]:
            index[name] = len(names)
            names.append(name)
        self.names, self._index, self._sent = tuple(names), index, sent
        more = len(names) - len(self._last_seen)
        self._last_seen = np.concatenate([self._last_seen, np.zeros(more, dtype=np.int64)])
        self._positions_m = np.concatenate([self._positions_m, np.zeros((more, 3))])
        self._rotations = np.concatenate([self._rotations, np.tile(np.eye(3), (more, 1, 1))])
        self._places = np.array([index[name] for name in sent], dtype=np.int64)
        return self._places


def _of_felt(parts: Arrays, places: IntArray, felt: np.ndarray) -> Arrays:
    """Return the arrays with the objects' indices in the frame, without the primitives of ignored objects."""
    found: Arrays = dict(parts)
    for kind in KINDS:
        owners = places[parts[kind.owner]]
        kept = felt[owners]
        names = [kind.owner, *(array.name for array in kind.arrays)]
        found[kind.owner] = owners
        if not kept.all():
            for name in names:
                found[name] = np.ascontiguousarray(found[name][kept])
    return found


def _which(things: Sequence[SeenObject], shape: str) -> IntArray:
    return np.array([k for k, thing in enumerate(things) if getattr(thing, shape)], dtype=np.int64)


def _rows(values: list[Any]) -> FloatArray:
    found: FloatArray = np.array(values, dtype=np.float64).reshape(-1, 3)
    return found
