"""Work in several processes, and how far it has got."""

import os
import signal

import pytest

from common.errors import FeelaheadError
from feelahead.lab.approaches import progress as module
from feelahead.lab.approaches.processes import in_processes
from feelahead.lab.progress import progress


def whoami(number: int) -> tuple[int, int]:
    return number, os.getpid()


def die(number: int) -> int:
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_one_worker_is_this_process_and_keeps_the_order() -> None:
    done = list(in_processes(whoami, [(3,), (1,), (2,)], 1))
    assert done == [(0, (3, os.getpid())), (1, (1, os.getpid())), (2, (2, os.getpid()))]
    assert list(in_processes(whoami, [], 2)) == []


@pytest.mark.processes
def test_several_workers_do_everything_once_elsewhere() -> None:
    done = dict(in_processes(whoami, [(number,) for number in range(5)], 2))
    assert {place: number for place, (number, _) in done.items()} == {place: place for place in range(5)}
    assert os.getpid() not in {process for _, process in done.values()}


@pytest.mark.processes
def test_a_worker_that_is_killed_is_one_line() -> None:
    with pytest.raises(FeelaheadError, match="a worker process was ended from outside"):
        list(in_processes(die, [(number,) for number in range(4)], 2))


@pytest.mark.processes
def test_whoever_has_seen_enough_leaves_nobody_behind() -> None:
    some = in_processes(whoami, [(number,) for number in range(50)], 2)
    _, (_, process) = next(some)
    some.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


def test_in_a_log_it_says_how_far_it_has_got(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_EVERY_S", 0.0)
    with progress("baking", 4.0) as advance:
        advance(1.0)
        advance(3.0)
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("baking: 25 %, about ")
    assert second == "baking: 100 %, about 0 min left"
