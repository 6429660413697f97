"""Kernels are compiled once, before their first call, and never loaded from outdated machine code."""

import errno
import os
from pathlib import Path

import numba
import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.compiled import kernel as compile_module
from robot_side.compiled.kernel import (
    Compiled,
    compiled,
    input_array,
    late_kernels,
    output_array,
)
from robot_side.compiled.machine_code import can_keep, keep, kept
from robot_side.compiled.numba_inside import machine


def _double(values: FloatArray, doubled: FloatArray) -> None:
    for i in range(values.size):
        doubled[i] = 2.0 * values[i]


def _kernel() -> Compiled:
    kernel = compiled(input_array(1), output_array(1))(_double)
    result = np.empty(2)
    kernel(np.array([1.0, 2.0]), result)
    assert result.tolist() == [2.0, 4.0]
    return kernel


def test_machine_code_is_kept_on_disk_until_any_source_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert _kernel().cache_hits == 0
    assert _kernel().cache_hits == 1
    monkeypatch.setattr(compile_module, "digest", lambda _: "another version")
    assert _kernel().cache_hits == 0


def test_machine_code_of_another_processor_or_version_is_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    _kernel()
    here = machine()
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr(compile_module, "machine", lambda: here.replace(numba.__version__, "0.1"))
        assert _kernel().cache_hits == 0
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr(numba.config, "CPU_NAME", "another")
        assert machine() != here
    assert _kernel().cache_hits == 1


def test_a_run_is_told_of_each_kernel_that_is_first_used_late() -> None:
    early, late, never, last = (compiled(input_array(1), output_array(1))(_double) for _ in range(4))
    early.prepare()
    told: list[str] = []
    arrays = np.ones(2), np.empty(2)
    with late_kernels(told.append):
        assert early.address != 0
        early(*arrays)
        assert told == []
        late(*arrays)
        late(*arrays)
        assert late.address != 0
        assert told == [late.name]

    def refuse(name: str) -> None:
        raise LookupError(name)

    with late_kernels(refuse):
        for use in (lambda: never(*arrays), lambda: never.address):
            with pytest.raises(LookupError, match="_double"):
                use()
    assert not never.ready
    last(*arrays)
    assert told == [late.name]


@pytest.mark.parametrize("content", [b"", b"\x80\x05garbage", None])
def test_damaged_machine_code_is_compiled_anew(
    content: bytes | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    kernel = _kernel()
    assert kernel.is_kept
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:50] if content is None else content)
    assert not kernel.is_kept
    assert _kernel().cache_hits == 0
    assert _kernel().cache_hits == 1


def test_a_kernel_works_where_nothing_can_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "below"))
    assert not can_keep()
    assert _kernel().cache_hits == 0
    assert _kernel().cache_hits == 0


def test_a_kernel_works_on_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    def part(self: Path, content: bytes) -> int:
        with self.open("wb") as file:
            file.write(content[:100])
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", part)
    assert _kernel().cache_hits == 0
    assert list(tmp_path.iterdir()) == []


def test_of_one_kernel_a_few_versions_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    (tmp_path / "of.another-0.machine-code").write_bytes(b"")
    for version in range(20):
        keep("of.one", str(version), b"machine code")
        newest = max(tmp_path.glob("of.one-*"), key=lambda file: file.stat().st_mtime)
        os.utime(newest, (version, version))
    assert kept("of.one", "19") == b"machine code"
    assert kept("of.one", "0") is None
    assert len(list(tmp_path.iterdir())) == 9


def test_an_array_of_another_kind_is_refused_rather_than_compiled_for() -> None:
    kernel = _kernel()
    with pytest.raises(TypeError):
        kernel(np.ones(2, dtype=np.float32), np.empty(2))
    with pytest.raises(TypeError):
        kernel(np.ones((2, 2)), np.empty(2))


def test_a_kernel_that_allocates_is_not_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compile_module, "_kernels", [])

    def allocates(values: FloatArray, doubled: FloatArray) -> None:
        doubled[:] = np.zeros(values.size)

    with pytest.raises(numba.TypingError):
        compiled(input_array(1), output_array(1))(allocates).prepare()
