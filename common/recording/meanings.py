"""Meaning of each field of a struct: the text below the field in the source, so that it is written only once."""

import ast
import inspect
import textwrap
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import Final

import msgspec

KEPT: Final = "__meanings__"
"""Attribute in which a struct that was made at run time, and has no source, keeps its fields' meanings"""


@cache
def meanings(kind: type[msgspec.Struct]) -> Mapping[str, str]:
    """Return the meaning of each field that has one, by the field's name, in one line without a full stop at the end.

    A field has the meaning of the newest class that declares it. Without the source, as in a frozen program, there are
    no meanings.
    """
    if (kept := vars(kind).get(KEPT)) is not None:
        return dict(kept)
    found: dict[str, str] = {}
    for one in reversed(kind.__mro__):
        if issubclass(one, msgspec.Struct) and one is not msgspec.Struct:
            found |= _written(one)
    return found


def _written(kind: type) -> dict[str, str]:
    try:
        body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    except (OSError, TypeError):
        return {}
    lines = body.body if isinstance(body, ast.ClassDef) else []
    found = {}
    for field, text in pairwise(lines):
        match field, text:
            case (
                ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str(written))),
            ):
                found[name] = " ".join(written.split()).removesuffix(".")
    return found
