"""Mutants of modules: one small change each, by the operators of cosmic-ray and one of our own."""

import ast
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import parso
from cosmic_ray.ast import Visitor, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.operator import Operator
from cosmic_ray.plugins import get_operator, operator_names

_PAIRS: Final = ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "FloorDiv_Mul", "Mod_Mul", "BitAnd_BitOr", "BitOr_BitAnd")
_ARITHMETIC: Final = {f"core/ReplaceBinaryOperator_{pair}" for pair in _PAIRS}
_OPPOSITES: Final = {"min": "max", "max": "min", "any": "all", "all": "any", "floor": "ceil", "ceil": "floor"}


class SwapOpposites(Operator):  # type: ignore[misc]  # cosmic-ray has no types
    """Replace min by max, any by all, floor by ceil, and the reverse."""

    def mutation_positions(self, node: Any) -> Iterator[tuple[Any, Any]]:
        """Yield the position of `node` if it is such a name."""
        if isinstance(node, parso.python.tree.Name) and node.value in _OPPOSITES:
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Return the opposite's name."""
        del index
        return parso.python.tree.Name(_OPPOSITES[node.value], node.start_pos, node.prefix)

    @classmethod
    def examples(cls) -> Sequence[Any]:
        """Return no examples: cosmic-ray tests its own operators by them."""
        return ()


@dataclass(frozen=True)
class Mutant:
    """One change of one line of a module."""

    module: str
    line: int
    operator: str
    before: str
    after: str
    code: str
    """Source of the changed module"""

    @property
    def name(self) -> str:
        """Name that stays the same when lines move: module, line before and after the change."""
        return f"{self.module}: {self.before} -> {self.after}"


class _Positions(Visitor):  # type: ignore[misc]
    """Lines on which an operator finds something to change, in the order of its occurrences."""

    def __init__(self, operator: Any) -> None:
        self.found: list[tuple[tuple[int, int], tuple[int, int]]] = []
        self._operator = operator

    def visit(self, node: Any) -> Any:
        self.found += self._operator.mutation_positions(node)
        return node


def sample(root: Path, modules: Sequence[str], number: int, seed: int) -> list[Mutant]:
    """Draw up to `number` mutants, no two of the same line. Each line with anything to change is as likely."""
    lines: dict[tuple[str, int], list[tuple[str, int]]] = {}
    for module in modules:
        for name, occurrence, line in _places((root / module).read_text(encoding="utf-8")):
            lines.setdefault((module, line), []).append((name, occurrence))
    drawn = random.Random(seed)  # noqa: S311
    order = sorted(lines)
    drawn.shuffle(order)
    made: list[Mutant] = []
    for module, line in order:
        if len(made) == number:
            break
        if (mutant := _made(root, module, line, drawn.choice(sorted(lines[module, line])))) is not None:
            made.append(mutant)
    return made


def _operators() -> dict[str, Any]:
    """Return operators by name: of arithmetic ones each with its opposite, none that needs arguments."""
    names = [name for name in operator_names() if name in _ARITHMETIC or "BinaryOperator" not in name]
    found = {name: get_operator(name) for name in names}
    return {name: kind() for name, kind in found.items() if not kind.arguments()} | {"SwapOpposites": SwapOpposites()}


def _places(source: str) -> Iterator[tuple[str, int, int]]:
    """Yield operator, number of its occurrence, and line of each change, but of annotations and decorators."""
    tree, spans = get_ast(source), list(_annotations(source))
    for name, operator in _OPERATORS.items():
        positions = _Positions(operator)
        positions.walk(tree)
        for occurrence, (start, end) in enumerate(positions.found):
            if not any(low <= start and end <= high for low, high in spans):
                yield name, occurrence, start[0]


def _annotations(source: str) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Yield start and end of each annotation and decorator: types and `frozen` are checked by mypy."""
    for node in ast.walk(ast.parse(source)):
        decorators = getattr(node, "decorator_list", [])
        for one in (getattr(node, "annotation", None), getattr(node, "returns", None), *decorators):
            if isinstance(one, ast.expr):
                yield (one.lineno, one.col_offset), (one.end_lineno or 0, one.end_col_offset or 0)


def _made(root: Path, module: str, line: int, place: tuple[str, int]) -> Mutant | None:
    """Return the mutant; None if its source is the same, or no Python."""
    source = (root / module).read_text(encoding="utf-8")
    name, occurrence = place
    code = mutate_code(source, _OPERATORS[name], occurrence)
    try:
        if code is None or ast.dump(ast.parse(code)) == ast.dump(ast.parse(source)):
            return None
    except SyntaxError:
        return None
    changed = [
        (old.strip(), new.strip())
        for old, new in zip(source.splitlines(), [*code.splitlines(), ""], strict=False)
        if old != new
    ]
    return Mutant(module, line, name, *changed[0], code)


_OPERATORS: Final = _operators()
