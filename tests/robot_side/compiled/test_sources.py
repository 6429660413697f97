"""Key of a kernel's machine code on disk: every change in the kernel's sources changes the key."""

import ast
import importlib
import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import robot_side
import robot_side.parts  # Imported before any test, because a library of the simulation starts a process when imported.
from robot_side.compiled import sources as kernel_sources
from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.compiled.sources import digest, sources

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


_BLOCK = """
from robot_side.compiled.kernel import inlined
from limits import LIMIT

@inlined
def clipped(value):
    return min({factor} * value, LIMIT)
"""
_KERNEL = """
import numpy as np
from robot_side.compiled.kernel import compiled, input_array, output_array
from deeper.blocks import clipped

@compiled(input_array(1), output_array(1))
def clip(values, clipped_values):
    for i in range(values.size):
        clipped_values[i] = clipped(values[i])

result = np.empty(2)
clip(np.array([1.0, 10.0]), result)
print(*result, clip.cache_hits)
"""


@pytest.mark.processes
def test_no_stale_machine_code_runs_when_a_file_elsewhere_changes(tmp_path: Path) -> None:
    # Numba's own key would depend on the kernel's file alone.
    (tmp_path / "deeper").mkdir()
    (tmp_path / "clip.py").write_text(_KERNEL)

    def run(factor: float, limit: float) -> str:
        (tmp_path / "limits.py").write_text(f"LIMIT = {limit}")
        (tmp_path / "deeper" / "blocks.py").write_text(_BLOCK.format(factor=factor))
        environment = os.environ | {
            "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
            "PYTHONPATH": f"{tmp_path}:{ROBOT_SIDE.parent}",
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        return subprocess.run(
            [sys.executable, "-m", "clip"], env=environment, capture_output=True, text=True, check=True, cwd=tmp_path
        ).stdout.strip()

    assert run(2.0, 5.0) == "2.0 5.0 0"
    assert run(2.0, 5.0) == "2.0 5.0 1"
    assert run(3.0, 5.0) == "3.0 5.0 0"
    assert run(3.0, 7.0) == "3.0 7.0 0"
    assert run(3.0, 7.0) == "3.0 7.0 1"
