"""The names that the page shares with us, written from our own: `python -m operator_side.viewing.console.names`.

page/names.js holds an object for each set of codes, and a type for each struct that the page reads or sends, for
editors. It is checked in; a test says when it is old.
"""

import json
import textwrap
from pathlib import Path
from typing import Final, get_args

from msgspec import inspect

from common.protocol.messages import MotionState, Telemetry
from common.protocol.session import SessionState
from common.protocol.view_messages import VIEW_NAMES
from common.status.codes import Doing, Hands, LinkState, Look, Phase, Readiness
from common.status.phase import PhaseFacts
from common.status.statuses import RobotStatus
from operator_side.viewing.facts import OperatorFacts, ShownKind
from operator_side.viewing.pages.page_messages import PageMessage

PATH: Final = Path(__file__).parent / "page" / "names.js"
_CODES: Final = (ShownKind, LinkState, SessionState, Phase, Look, Doing, Hands, Readiness)
_STRUCTS: Final = (OperatorFacts, PhaseFacts, PageMessage)
_BEFORE: Final = "// Codes and structs of ours, made by: python -m operator_side.viewing.console.names\n"
_WHOLE: Final = (Telemetry, RobotStatus)
"""Structs that names.js does not spell out: a new figure in them is none of its business."""
_PLAIN: Final[dict[type, str]] = {inspect.BoolType: "boolean", inspect.NoneType: "null"}


def names() -> str:
    """The text of page/names.js."""
    codes = {one.__name__: {member.name: member.value for member in one} for one in _CODES}
    codes["MotionState"] = {state.upper(): state for state in get_args(MotionState)}
    structs: dict[str, str] = {}
    for struct in _STRUCTS:
        _type(inspect.type_info(struct), structs)
    lines = [_BEFORE, f"export const VIEWS = {json.dumps(VIEW_NAMES)}; // by their number on the wire"]
    for name, members in codes.items():
        said = ", ".join(f"{key}: {json.dumps(value)}" for key, value in members.items())
        lines.append(_wrapped(f"export const {name} = Object.freeze({{ {said} }});", "  "))
    for name, fields in structs.items():
        lines.append(_wrapped(f"/** @typedef {{{{ {fields} }}}} {name} */", " * "))
    return "\n".join([*lines, ""])


def _wrapped(text: str, before: str) -> str:
    """At most 120 columns; a name stays beside what it stands for."""
    lines = textwrap.wrap(text.replace(": ", ":\0"), 120, subsequent_indent=before, break_long_words=False)
    return "\n".join(lines).replace("\0", " ")


def _type(kind: inspect.Type, structs: dict[str, str]) -> str:
    """The type in JSDoc's words; the structs in it are added to `structs`, with their fields."""
    match kind:
        case inspect.StructType(cls=cls) if cls in _WHOLE:
            return "Object"
        case inspect.StructType(cls=cls, fields=fields):
            structs[cls.__name__] = ", ".join(f"{one.encode_name}: {_type(one.type, structs)}" for one in fields)
            return cls.__name__
        case inspect.UnionType(types=types):
            return "|".join(_type(one, structs) for one in types)
        case inspect.VarTupleType(item_type=item) | inspect.TupleType(item_types=(item, *_)):
            return f"{_type(item, structs)}[]"
        case inspect.FloatType() | inspect.IntType() | inspect.LiteralType(values=(int(), *_)):
            return "number"
    return _PLAIN.get(type(kind), "string")


def main() -> None:
    """Write it."""
    PATH.write_text(names(), encoding="utf-8")


if __name__ == "__main__":
    main()
