"""Types of the JSON messages in a recording, by topic, and the JSON schemas that follow from declared types.

Messages that are arrays on the wire are recorded with the names of their fields.
"""

from collections.abc import Mapping
from functools import cache
from types import UnionType
from typing import Any, Final, Literal, Union, get_args

import msgspec
from msgspec import inspect

from common.episode import EpisodeMark
from common.protocol.messages import MotionCommand, StiffnessUpdate, Telemetry, Vector3
from common.protocol.view_messages import EnlargementTerms
from common.recording.meanings import KEPT, meanings
from common.recording.wire import BINARY
from common.status.statuses import OperatorStatus, RobotStatus

FACTS_TOPIC: Final = "/operator/facts"
"""Topic whose type belongs to the operator side, which sends its schema"""
Side = Literal["robot", "operator"]


class Moment(msgspec.Struct, frozen=True):
    """Time of a message."""

    time_s: float
    """Time on the recording side's monotonic clock"""


class Stamps(Moment, frozen=True):
    """Stamps of a control message."""

    side: Side
    """Side that recorded the message"""
    sequence: int
    """Number of the message in its sender's epoch, counted over all kinds of messages together"""
    sent_s: float
    """Time at which the message entered its delay line, on the sender's monotonic clock"""
    age_ms: float | None
    """Time since `sent_s` when it was recorded; 0 at the side that sent it"""
    loop_age_ms: float | None
    """Time from the departure of our message that it echoes to its arrival; None at the side that sent it"""


class ViewStamps(Moment, frozen=True):
    """Stamps of a view message."""

    sequence: int
    """Number of the message in its sender's epoch, counted over all kinds of messages together"""
    sent_s: float
    """Time at which the message entered its delay line, on the robot side's monotonic clock"""


class Ages(Moment, frozen=True):
    """Ages of what a side uses; None while unknown."""

    side: Side
    """Side that uses the data"""
    command_ms: float | None
    """Age of the command that moves the arm, at the robot side"""
    field_ms: float | None
    """Age of the trigger field that is felt, at the operator side"""
    frame_ms: float | None
    """Age of the frame of perceived objects in use, at the robot side"""


class Episode(Moment, frozen=True):
    """Mark of an episode."""

    side: Side
    """Side that recorded the mark"""
    mark: EpisodeMark
    """Mark: start, success, failure, discard or reset"""


class Truth(Moment, frozen=True):
    """What is true in the simulation, which no controller knows. Counts and sums are since the start of the run."""

    armed: bool
    """Whether the arm follows commands"""
    tool_m: Vector3
    """True position of the tool, in the world frame"""
    obstacle_mm: float | None
    """Distance in the world frame from the gripper to the nearest obstacle, negative inside it; None beyond 1 m"""
    held: str | None
    """Object that the gripper holds"""
    hits: int
    """Contacts of the gripper with all but the target, and of what it holds with obstacles"""
    hit_first: str | None
    """Object that was hit first"""
    fastest_hit_mm_s: float | None
    """Greatest closing speed of a hit"""
    impulse_n_s: float
    """Sum over time of the normal forces of hits, in N s"""
    placed: bool
    """Whether the target was lifted and stands by itself"""


class Terms(msgspec.Struct, frozen=True):
    """Terms of the enlargement along each trigger."""

    l2: EnlargementTerms
    r2: EnlargementTerms


class ObjectOverlap(msgspec.Struct, frozen=True):
    """Volume that the enlarged gripper shares with an object, along each trigger."""

    object: str
    l2_mm3: float
    """Volume of object OBJECT in the gripper inflated by D_σ and moved by δ along L2, counted once (eq. 11-12)"""
    r2_mm3: float
    """Volume of object OBJECT in the gripper inflated by D_σ and moved by δ along R2, counted once (eq. 11-12)"""


class Overlaps(ViewStamps, frozen=True):
    """Overlaps of the objects."""

    objects: list[ObjectOverlap]


class Unseen(Moment, frozen=True):
    """Share, 0 to 1, of the space on each side of the gripper that no depth camera has seen."""

    ahead: float
    """Share of the space ahead of the gripper, within 0.25 m of the tool"""
    left: float
    """Share of the space to the left of the gripper"""
    right: float
    """Share of the space to the right of the gripper"""
    up: float
    """Share of the space above the gripper"""
    down: float
    """Share of the space below the gripper"""


def by_name(value: Any) -> Any:
    """Return a struct as a dict without its header, nested ones as dicts, too; any other value as it is."""
    if not isinstance(value, msgspec.Struct):
        return value
    fields = msgspec.structs.asdict(value)
    return {name: by_name(one) for name, one in fields.items() if name != "header"}


@cache
def _named(kind: type[msgspec.Struct], before: type[msgspec.Struct] | None = None) -> type[msgspec.Struct]:
    """Return the type of what `by_name` makes of a `kind`, with the fields of `before` in front."""
    parts = [part for part in (before, kind) if part is not None]
    fields = [
        (one.name, _named_hint(one.type), msgspec.field(name=one.encode_name, **_default(one)))
        for part in parts
        for one in msgspec.structs.fields(part)
        if one.name != "header"
    ]
    kept = {name: text for part in parts for name, text in meanings(part).items()}
    return msgspec.defstruct(kind.__name__, fields, namespace={"__doc__": kind.__doc__, KEPT: kept}, kw_only=True)


def _named_hint(hint: Any) -> Any:
    if isinstance(hint, UnionType):
        return Union[tuple(_named_hint(one) for one in get_args(hint))]  # noqa: UP007  # of a computed tuple
    return _named(hint) if isinstance(hint, type) and issubclass(hint, msgspec.Struct) else hint


def _default(one: msgspec.structs.FieldInfo) -> dict[str, Any]:
    return {} if one.default is msgspec.NODEFAULT else {"default": one.default}


TYPES: Final[Mapping[str, type[msgspec.Struct]]] = {
    "/stiffness": _named(StiffnessUpdate, Stamps),
    "/command": _named(MotionCommand, Stamps),
    "/ages": Ages,
    "/episode": Episode,
    "/truth": Truth,
    "/telemetry": _named(Telemetry, ViewStamps),
    "/enlargement": _named(Terms, ViewStamps),
    "/overlap": Overlaps,
    "/unseen": Unseen,
    "/robot/status": _named(RobotStatus, Moment),
    "/operator/status": _named(OperatorStatus, Moment),
}
"""Type of the messages of each JSON topic but FACTS_TOPIC"""
OURS: Final = frozenset({*TYPES, *BINARY, FACTS_TOPIC})
"""Topics of nobody else, whose stamps are the run's times; also /log, /tf, /scene and /camera/... are recorded"""


def json_schema(topic: str, kind: type[msgspec.Struct]) -> dict[str, Any]:
    """Return the JSON schema of `kind`, in the form that most tools read.

    Definitions stand where they are used, each schema has a `type`, a value that may be null has two, and a tuple of
    equal items has `items`. So do the schemas that Foxglove's SDK derives from types. A value has the meaning of its
    field as `description`.
    """
    (schema,), components = msgspec.json.schema_components((kind,), ref_template="{name}")
    plain = _described(_plain(schema, components), inspect.type_info(kind))
    return plain | {"title": f"feelahead.{topic.title().replace('/', '')}"}


def _described(schema: dict[str, Any], kind: inspect.Type) -> dict[str, Any]:
    """Return the schema of `kind` with the meanings of its fields, and of the fields of these."""
    if isinstance(kind, inspect.UnionType):
        return _described(schema, kind.types[0])
    if not isinstance(kind, inspect.StructType) or "properties" not in schema:
        return schema
    of = meanings(kind.cls)
    fields = {
        one.encode_name: _described(schema["properties"][one.encode_name], one.type)
        | ({"description": of[one.name]} if one.name in of else {})
        for one in kind.fields
    }
    return schema | {"properties": schema["properties"] | fields}


def _plain(schema: dict[str, Any], components: Mapping[str, Any]) -> dict[str, Any]:
    schema = components[schema["$ref"]] | schema if "$ref" in schema else schema
    plain = {name: value for name, value in schema.items() if name not in ("$ref", "anyOf", "default")}
    if "anyOf" in schema:
        one, null = (_plain(one, components) for one in schema["anyOf"])  # None is the only alternative that we declare
        plain |= one | {"type": [one["type"], null["type"]]}
        if "enum" in one:
            plain["enum"] = [*one["enum"], None]
    if "enum" in schema:
        plain["type"] = "string"
    if "properties" in schema:
        plain["properties"] = {name: _plain(one, components) for name, one in schema["properties"].items()}
    items = [_plain(one, components) for one in schema.get("prefixItems", ())]
    if items and all(one == items[0] for one in items):
        del plain["prefixItems"]
        plain["items"] = items[0]
    elif items:
        plain["prefixItems"] = items
    elif "items" in schema:
        plain["items"] = _plain(schema["items"], components)
    return plain
