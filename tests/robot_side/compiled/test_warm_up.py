"""Compilation before a run: what is said meanwhile, and of which kernels."""

from pathlib import Path

import pytest

from robot_side.compiled import warm_up as module
from robot_side.compiled.warm_up import warm_up
from tests.robot_side.compiled.fresh_kernels import NAMES, fresh_kernels


def test_a_compilation_says_how_many_kernels_are_ready(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(module, "_NOTEWORTHY_S", 0.0)
    monkeypatch.setattr(module, "_BETWEEN_NOTES_S", 0.01)
    said: list[tuple[int, int]] = []
    compiled: list[str] = []
    for _ in range(2):
        warm_up(lambda ready, of: said.append((ready, of)), fresh_kernels(), compiled.append)
    assert sorted(compiled) == sorted(NAMES), "the second time all are on disk"
    assert said == sorted(said), "the second time nothing is missing, and nothing is said"
    assert {of for _, of in said} == {len(NAMES)}
