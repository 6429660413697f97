"""No function changes a variable at the top of a module: each state belongs to an object.

Caches of pure functions are exempt.
"""

import ast
from collections.abc import Iterator

from tests.helpers.repository import ROOT

REGISTRIES = {
    ("robot_side/compiled/kernel.py", "_kernels"),  # Filled while modules are imported.
    ("robot_side/compiled/kernel.py", "_told"),  # Those whom a running process has asked to be told.
}
PACKAGES = ("common", "robot_side", "operator_side", "feelahead")
CHANGES = {
    *("append", "appendleft", "extend", "insert", "add", "update", "setdefault", "fill"),
    *("pop", "popleft", "popitem", "remove", "discard", "clear"),
}


def changed(tree: ast.Module) -> set[str]:
    top = {name for line in tree.body for name in _named(line)}
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    return {name for function in functions for name in _changed_by(function) if name in top}


def _named(line: ast.stmt) -> Iterator[str]:
    if isinstance(line, ast.Assign | ast.AnnAssign):
        nodes = [node for node in ast.walk(line) if isinstance(node, ast.Name)]
        yield from (node.id for node in nodes if isinstance(node.ctx, ast.Store))
    elif isinstance(line, ast.Import | ast.ImportFrom):
        for one in line.names:
            if (getattr(line, "module", None) or one.name).partition(".")[0] in PACKAGES:
                yield one.asname or one.name.partition(".")[0]


def _changed_by(function: ast.FunctionDef | ast.AsyncFunctionDef) -> set[str]:
    nodes = list(ast.walk(function))
    arguments = [one.arg for node in nodes if isinstance(node, ast.arguments) for one in [*node.args, *node.kwonlyargs]]
    own = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)} | {*arguments}
    found = set()
    for node in nodes:
        if isinstance(node, ast.Subscript | ast.Attribute) and not isinstance(node.ctx, ast.Load):
            found |= _root(node)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in CHANGES:
            found |= _root(node.func)
    return (found - own) | {name for node in nodes if isinstance(node, ast.Global) for name in node.names}


def _root(node: ast.expr) -> set[str]:
    while isinstance(node, ast.Subscript | ast.Attribute):
        node = node.value
    return {node.id} if isinstance(node, ast.Name) else set()


def test_nothing_at_a_modules_top_is_changed_but_registries() -> None:
    found = {
        (path.relative_to(ROOT).as_posix(), name)
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        for name in changed(ast.parse(path.read_text(encoding="utf-8")))
    }
    assert found == REGISTRIES
