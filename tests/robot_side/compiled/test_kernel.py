"""The kernels' compilation: once, beforehand, and never from stale machine code."""

from pathlib import Path

import numba
import numpy as np
import pytest

from common.arrays import FloatArray
from robot_side.compiled import kernel as compile_module
from robot_side.compiled.kernel import (
    COUNT,
    Compiled,
    compiled,
    imported_kernels,
    input_array,
    output_array,
    record_array,
)
from robot_side.overlap import warm_up


def _double(values: FloatArray, doubled: FloatArray) -> None:
    for i in range(values.size):
        doubled[i] = 2.0 * values[i]


def _kernel() -> Compiled:
    kernel = compiled(input_array(1), output_array(1))(_double)
    result = np.empty(2)
    kernel(np.array([1.0, 2.0]), result)
    assert result.tolist() == [2.0, 4.0]
    return kernel


def test_warm_up_leaves_nothing_to_compile() -> None:
    assert warm_up() > 0.0
    needed = {"overlap_boxes", "overlap_tetrahedra", "precise_boxes", "precise_tetrahedra", "_sphere_loop"}
    ready = {kernel.name.split(".")[-1] for kernel in imported_kernels() if kernel.ready}
    assert needed <= ready
    assert all(kernel.ready for kernel in imported_kernels() if kernel.name.startswith("robot_side."))


def test_machine_code_is_kept_on_disk_until_any_source_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    assert _kernel().cache_hits == 0
    assert _kernel().cache_hits == 1
    monkeypatch.setattr(compile_module, "digest", lambda _: "another version")
    assert _kernel().cache_hits == 0


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
@pytest.mark.parametrize("content", [b"", b"\x80\x05garbage", None])
def test_damaged_machine_code_is_compiled_anew(
    suffix: str, content: bytes | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    _kernel()
    (file,) = tmp_path.rglob(f"*.{suffix}")
    file.write_bytes(file.read_bytes()[:50] if content is None else content)
    assert _kernel().cache_hits == 0
    assert _kernel().cache_hits == 1


def test_a_kernel_works_where_nothing_can_be_written(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_place(*_: object) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(compile_module, "keep_on_disk", no_place)
    assert _kernel().cache_hits == 0


def test_an_array_of_another_kind_is_refused_rather_than_compiled_for() -> None:
    kernel = _kernel()
    with pytest.raises(TypeError):
        kernel(np.ones(2, dtype=np.float32), np.empty(2))
    with pytest.raises(TypeError):
        kernel(np.ones((2, 2)), np.empty(2))


_PAIR = np.dtype([("row", np.int64), ("way", np.float64, (2,))])


def _halve(pairs: np.ndarray, halved: int) -> None:
    for k in range(halved):
        pairs[k].row += 1
        pairs[k].way[1] = 0.5 * pairs[k].way[0]


def test_records_with_named_fields_are_read_and_filled() -> None:
    kernel = compiled(record_array(_PAIR), COUNT)(_halve)
    pairs = np.zeros(3, dtype=_PAIR)
    pairs["row"], pairs["way"][:, 0] = [5, 6, 7], [1.0, 2.0, 3.0]
    kernel(pairs, 2)
    assert pairs["row"].tolist() == [6, 7, 7]
    assert pairs["way"][:, 1].tolist() == [0.5, 1.0, 0.0]
    other = np.dtype([("row", np.int64), ("way", np.float64)])
    with pytest.raises(TypeError):
        kernel(np.zeros(3, dtype=other), 2)
