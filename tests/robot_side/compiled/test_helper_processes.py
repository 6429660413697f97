"""Compilation in helper processes: how kernels are shared out, which files are stored, and failures."""

import os
import select
import signal
from collections.abc import Sequence
from pathlib import Path

import pytest

from common.companion.process import Companion
from robot_side.compiled import helper_processes
from robot_side.compiled import warm_up as warm_up_module
from robot_side.compiled.helper_processes import KernelQueue, compile_in_helpers
from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.compiled.sources import code_sizes
from robot_side.compiled.warm_up import warm_up
from tests.helpers.machines.waiting import LIMIT_S
from tests.robot_side.compiled.fresh_kernels import NAMES, fresh_kernels


def ours() -> list[Compiled]:
    return [kernel for kernel in imported_kernels() if kernel.is_ours]


def taken_in_turns(kernels: Sequence[Compiled], processes: int) -> list[list[Compiled]]:
    """Return which kernels each process takes, if compilation takes time in proportion to the bytecode."""
    queue, busy, found = KernelQueue(kernels, processes), [0] * processes, [list[Compiled]() for _ in range(processes)]
    while (kernel := queue.take(place := busy.index(min(busy)))) is not None:
        before = size(found[place])
        found[place].append(kernel)
        busy[place] += size(found[place]) - before
    return found


def size(kernels: Sequence[Compiled]) -> int:
    return sum({part: bytes_ for kernel in kernels for part, bytes_ in code_sizes(kernel.function).items()}.values())


@pytest.mark.parametrize("count", [1, 2, 3])
def test_each_kernel_goes_to_one_process_and_all_end_alike(count: int) -> None:
    found = taken_in_turns(ours(), count)
    assert sorted(kernel.name for part in found for kernel in part) == sorted(kernel.name for kernel in ours())
    sizes = [size(part) for part in found]
    assert min(sizes) > 0.8 * max(sizes)
    # Little is compiled twice.
    assert sum(sizes) < 1.25 * size(ours())


@pytest.mark.processes
def test_other_processes_leave_machine_code_that_is_loaded_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    told: list[str] = []
    fresh = fresh_kernels()
    compile_in_helpers(fresh, 2, told.append)
    assert sorted(told) == sorted(NAMES)
    for kernel in fresh:
        kernel.prepare()
    assert [kernel.cache_hits for kernel in fresh] == [1, 1, 1]


@pytest.mark.processes
def test_a_process_that_is_killed_leaves_the_rest_to_us(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    class Killed(Companion):
        def __init__(self, module: str) -> None:
            super().__init__(module)
            os.kill(self.process_id, signal.SIGKILL)

    monkeypatch.setattr(helper_processes, "Companion", Killed)
    monkeypatch.setattr(warm_up_module, "_WORTH_A_PROCESS", 0)
    fresh = fresh_kernels()
    warm_up(kernels=fresh)
    assert [kernel.cache_hits for kernel in fresh] == [0, 0, 0]
    assert all(kernel.is_kept for kernel in fresh)


@pytest.mark.processes
def test_a_helper_ends_with_its_owner_even_in_a_compilation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    with Companion("robot_side.compiled.helper_processes") as helper:
        helper.channel.send(max(ours(), key=lambda kernel: size([kernel])).name.encode())
        ended = os.pidfd_open(helper.process_id)
        helper.channel.close()
        assert select.select([ended], [], [], LIMIT_S)[0]
        os.close(ended)
    assert list(tmp_path.iterdir()) == []


def test_without_a_place_to_keep_it_no_process_is_started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "below"))
    monkeypatch.setattr(warm_up_module, "_WORTH_A_PROCESS", 0)
    monkeypatch.setattr(warm_up_module, "compile_in_helpers", None)
    fresh = fresh_kernels()
    told: list[str] = []
    warm_up(kernels=fresh, done=told.append)
    assert all(kernel.ready for kernel in fresh)
    assert told == [kernel.name for kernel in fresh]


def test_a_compilation_says_how_many_kernels_are_ready(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(warm_up_module, "_NOTEWORTHY_S", 0.0)
    monkeypatch.setattr(warm_up_module, "_BETWEEN_NOTES_S", 0.01)
    said: list[tuple[int, int]] = []
    for _ in range(2):
        warm_up(lambda ready, of: said.append((ready, of)), fresh_kernels())
    assert said == sorted(said), "the second time nothing is missing, and nothing is said"
    assert {of for _, of in said} == {len(NAMES)}
