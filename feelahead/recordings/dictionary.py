"""Dictionary of all exported columns: unit, frame and meaning of each, made from the types of the recorded messages."""

import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from itertools import groupby
from typing import Final, NamedTuple

import msgspec
from msgspec import inspect

from common.recording.meanings import meanings
from common.recording.topics import FACTS_TOPIC, TYPES
from feelahead.recordings.rows import ArmRow, ControllerRow, FeltRow
from operator_side.viewing.facts import OperatorFacts

TIME: Final = "recording_s"
JOINED: Final = "joined"
FILE: Final = "columns.md"
"""Name of the file beside an export that has the dictionary of its columns"""
PACKED: Final = ("header", "around")
"""Parts of messages that no table has, as their values are packed, or are in other columns, too"""
_UNITS: Final = {
    **{"_rad_s": "rad/s", "_m_s2": "m/s²", "_m_s": "m/s", "_kbit_s": "kbit/s", "_percent": "%", "_rad": "rad"},
    **{"_mm3": "mm³", "_mm": "mm", "_ms": "ms", "_us": "µs", "_m": "m", "_s": "s"},
}
"""Unit by the end of a column's name; the first that fits counts"""
_FRAME: Final = re.compile(
    r"in the (\w+) frame|along (R2's direction|the trigger|each trigger|the motion|the jaws' motion|L2|R2)\b"
    r"|in (any direction)"
)
_NUMBER: Final = re.compile(r"(?<=\.)\d+(?=\.|$)")
_OBJECT: Final = "OBJECT"
_MANY: Final = 3
_NO_MEANING: Final = "unknown to this version, which did not make the recording"


class Column(NamedTuple):
    """Column of a table, or several that differ only in the number at the end of their names."""

    name: str
    """Name with `#` in place of a number"""
    unit: str
    """Unit; 1 for a number without one, "0 or 1" for a truth value, "text" for a text"""
    frame: str
    """Frame or direction of a length, an angle or a motion; empty for other values"""
    meaning: str
    of: int | None = 1
    """Number of columns; None if it depends on the recording"""

    @property
    def shown(self) -> str:
        """Name, or the first and the last name, for people."""
        if self.of == 1:
            return f"`{self.name}`"
        last = "" if self.of is None else f" `{self.name.replace('#', str(self.of - 1))}`"
        return f"`{self.name.replace('#', '0')}` to{last or ' …'}"


KINDS: Final[Mapping[str, type[msgspec.Struct]]] = {
    **{topic[1:].replace("/", "_"): kind for topic, kind in TYPES.items()},
    FACTS_TOPIC[1:].replace("/", "_"): OperatorFacts,
    "arm": ArmRow,
    "controller": ControllerRow,
    "felt": FeltRow,
}
"""Type of each table's rows"""


@cache
def columns_of(table: str) -> Mapping[str, Column]:
    """Return all columns that a table may have, by their names with `#` for numbers; none for an unknown table."""
    if table not in KINDS:
        return {}
    return {column.name: column for column in _walk(inspect.type_info(KINDS[table]), "", "")}


@cache
def parents_of(table: str) -> frozenset[str]:
    """Return the names that have others below them, such as `l2` for `l2.fast_m.0`: they are no columns."""
    parts = (name.split(".") for name in columns_of(table))
    return frozenset(".".join(one[:end]) for one in parts for end in range(1, len(one)))


def column_of(table: str, name: str) -> Column:
    """Return the entry for a column of an exported table; in the table `joined` the name begins with a table's."""
    if table == JOINED and name != TIME:
        table, _, name = name.partition(".")
    if name == TIME:
        return Column(TIME, "s", "", "Time since the recording began, by the recording machine's wall clock")
    known = columns_of(table)
    numbered = _NUMBER.sub("#", name)
    of_object = f"{_OBJECT}.{name.rpartition('.')[2]}"
    return known.get(numbered) or known.get(of_object) or Column(name, "?", "", _NO_MEANING)


def _walk(kind: inspect.Type, name: str, meaning: str) -> Iterator[Column]:
    match kind:
        case inspect.Metadata(type=inner):
            yield from _walk(inner, name, meaning)
        case inspect.UnionType(types=types):
            yield from _walk(next(one for one in types if not isinstance(one, inspect.NoneType)), name, meaning)
        case inspect.StructType(cls=cls, fields=fields):
            for one in fields:
                if one.name not in PACKED:
                    below = f"{name}.{one.encode_name}" if name else one.encode_name
                    yield from _walk(one.type, below, meanings(cls).get(one.name, ""))
        case inspect.ListType(item_type=inspect.StructType(cls=cls, fields=fields)):  # a list of objects
            for one in fields:
                if one.name != "object":
                    yield from _walk(one.type, f"{_OBJECT}.{one.name}", meanings(cls).get(one.name, ""))
        case inspect.TupleType(item_types=items):
            yield from (one._replace(of=len(items)) for one in _walk(items[0], f"{name}.#", meaning))
        case inspect.VarTupleType(item_type=item):
            yield from (one._replace(of=None) for one in _walk(item, f"{name}.#", meaning))
        case _:
            slides = re.search(r"; (m(?:etres|/s)?) for a prismatic joint", meaning)
            other = "" if slides is None else f", {slides[1].replace('metres', 'm')} if prismatic"
            yield Column(name, _unit(name, kind) + other, _frame(meaning), meaning)


def _unit(name: str, kind: inspect.Type) -> str:
    own = name.removesuffix(".#")
    for end, unit in _UNITS.items():
        if own.endswith(end):
            return unit
    if isinstance(kind, inspect.BoolType):
        return "0 or 1"
    return "1" if isinstance(kind, inspect.FloatType | inspect.IntType) else "text"


def _frame(meaning: str) -> str:
    found = _FRAME.search(meaning)
    return "" if found is None else found[1] or found[2] or found[3]


def dictionary(tables: Iterable[tuple[str, Iterable[str]]]) -> str:
    """Return the dictionary of these tables' columns, (table, columns) each, as Markdown."""
    parts = [_HEAD]
    for table, names in tables:
        if table == JOINED:
            parts.append(f"## {JOINED}\n\n{_ABOUT_JOINED}")
            continue
        about = (KINDS[table].__doc__ or "").splitlines()[0] if table in KINDS else _NO_MEANING
        parts.append(f"## {table}\n\n{about}\n\n{table_of(column_of(table, name) for name in names)}")
    return "\n\n".join(parts) + "\n"


def every_table() -> list[tuple[str, Iterable[str]]]:
    """Return all tables that an export may have, each with all the columns that it may have."""
    return [*((name, columns_of(name)) for name in sorted(KINDS)), (JOINED, ())]


def table_of(columns: Iterable[Column]) -> str:
    """Return a table of these columns as Markdown; consecutive columns with one meaning share a line."""
    lines = ["| column | unit | frame | meaning |", "|---|---|---|---|"]
    for (unit, frame, meaning), alike in groupby(columns, lambda one: one[1:4]):
        names = list(dict.fromkeys(one.shown for one in alike))
        shown = ", ".join(names) if len(names) < _MANY else f"{names[0]} to {names[-1]}"
        cells = (text.replace("|", "\\|") for text in (shown, unit, frame, meaning))
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


_HEAD: Final = f"""# Columns

Each table has the column `{TIME}`, in seconds: the time since the recording began. An empty value is unknown. A unit of
1 is a number without unit. Numbers at the end of names count from 0. Equations and sections are the paper's.
What a trigger meets now is `meets`; what the present course leads to, s(δ), is `course_stiffness`.
Every length, speed and angle has the frame of its coordinates, or the direction along which it counts."""
_ABOUT_JOINED: Final = """\
The newest values of the other tables at each time. A column is named after its table: `stiffness.r2.course_stiffness`
is `r2.course_stiffness` of `stiffness`."""
