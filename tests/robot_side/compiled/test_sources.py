"""Key of a kernel's machine code on disk: every change in the kernel's sources changes the key."""

import ast
import importlib
import pkgutil
import sys
from pathlib import Path

import pytest

import robot_side
import robot_side.parts  # Imported before any test, because a library of the simulation starts a process when imported.
from common.arrays import FloatArray
from robot_side.compiled import sources as kernel_sources
from robot_side.compiled.kernel import JIT, Compiled, imported_kernels
from robot_side.compiled.sources import digest, sources
from robot_side.compiled.warm_up import PROJECTS_KERNELS, kernels_compiled

ROBOT_SIDE = Path(robot_side.__file__).parent
_MARKS = {"inlined", "building_block", "compiled", "intrinsic"}


def _every_kernel() -> list[Compiled]:
    for module in pkgutil.walk_packages([str(ROBOT_SIDE)], "robot_side."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    return [kernel for kernel in imported_kernels() if kernel.name.startswith("robot_side.")]


def _has_code_for_kernels(path: Path) -> bool:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    decorators = [
        decorator for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) for decorator in node.decorator_list
    ]
    called = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
    used = [ast.unparse(node.func if isinstance(node, ast.Call) else node) for node in [*decorators, *called]]
    return any(name.split(".")[-1].split(")")[0] in _MARKS or "intrinsic" in name for name in used)


def test_the_summary_counts_the_kernels_of_every_module() -> None:
    assert len([kernel for kernel in _every_kernel() if kernel.is_ours]) == PROJECTS_KERNELS
    assert kernels_compiled().of == PROJECTS_KERNELS * JIT


def test_every_file_with_code_for_kernels_is_in_some_kernels_digest() -> None:
    with_code = {path for path in ROBOT_SIDE.rglob("*.py") if _has_code_for_kernels(path)}
    assert len(with_code) > 30
    covered = frozenset().union(*(sources(kernel.function) for kernel in _every_kernel()))
    assert with_code - covered == set()


def test_a_change_in_any_source_changes_the_digest(monkeypatch: pytest.MonkeyPatch) -> None:
    content = kernel_sources._content
    for kernel in _every_kernel():
        before = digest(kernel.function)
        for changed in sources(kernel.function):
            with monkeypatch.context() as patch:
                patch.setattr(
                    kernel_sources,
                    "_content",
                    lambda path, changed=changed: content(path) + (b"# changed" if path == changed else b""),
                )
                assert digest(kernel.function) != before, f"{kernel.name} does not notice {changed}"
        assert digest(kernel.function) == before


_MOST = 5.0


def _limited(values: FloatArray, limited: FloatArray) -> None:
    for i in range(values.size):
        limited[i] = min(values[i], _MOST)


def test_a_change_in_a_constant_changes_the_digest(monkeypatch: pytest.MonkeyPatch) -> None:
    before = digest(_limited)
    monkeypatch.setattr(sys.modules[__name__], "_MOST", 7.0)
    assert digest(_limited) != before
