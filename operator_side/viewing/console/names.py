"""The names that the page shares with us, written from our own: `python -m operator_side.viewing.console.names`.

page/names.js holds an object for each set of codes, and a type for each struct that the page reads or sends, for
editors. It is checked in; a test says when it is old.
"""

from enum import Enum
from pathlib import Path
from typing import Final, get_args

from msgspec import inspect

from common.protocol.messages import MotionState
from common.protocol.session import SessionState
from common.protocol.view_messages import VIEW_NAMES
from common.status.codes import Doing, Hands, LinkState, Look, Phase, Readiness
from common.status.phase import PhaseFacts
from operator_side.viewing.facts import OperatorFacts, ShownKind
from operator_side.viewing.pages.page_messages import PageMessage

PATH: Final = Path(__file__).parent / "page" / "names.js"
_CODES: Final = (ShownKind, LinkState, SessionState, Phase, Look, Doing, Hands, Readiness)
_STRUCTS: Final = (OperatorFacts, PhaseFacts, PageMessage)
_BEFORE: Final = "// Codes and structs of ours, made by: python -m operator_side.viewing.console.names\n"
_PLAIN: Final[dict[type, str]] = {inspect.BoolType: "boolean", inspect.NoneType: "null"}


def names() -> str:
    """The text of page/names.js."""
    codes: dict[str, dict[str, str]] = {one.__name__: _members(one) for one in _CODES}
    codes["MotionState"] = {state.upper(): state for state in get_args(MotionState)}
    structs: dict[str, str] = {}
    for struct in _STRUCTS:
        _type(inspect.type_info(struct), structs)
    lines = [_BEFORE, f"export const VIEWS = {list(VIEW_NAMES)}; // by their number on the wire".replace("'", '"')]
    for name, members in codes.items():
        lines += ["", f"export const {name} = Object.freeze({{", *(f'  {k}: "{v}",' for k, v in members.items()), "});"]
    return "\n".join([*lines, *structs.values(), ""])


def _members(codes: type[Enum]) -> dict[str, str]:
    return {member.name: member.value for member in codes}


def _type(kind: inspect.Type, structs: dict[str, str]) -> str:
    """The type in JSDoc's words; the structs in it are added to `structs`."""
    match kind:
        case inspect.StructType(cls=cls, fields=fields):
            rows = [f" * @property {{{_type(one.type, structs)}}} {one.encode_name}" for one in fields]
            structs[cls.__name__] = "\n".join(["", "/**", f" * @typedef {{Object}} {cls.__name__}", *rows, " */"])
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
