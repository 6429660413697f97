"""Output that nobody is held up by: in order while it is read, dropped while it is not, and its end told once."""

import contextlib
import os
from collections.abc import Iterator
from typing import TextIO

import pytest

from common.command.patient_output import PatientOutput


@contextlib.contextmanager
def pipe() -> Iterator[tuple[int, TextIO]]:
    reads, writes = os.pipe()
    with os.fdopen(writes, "w", encoding="utf-8") as stream:
        yield reads, stream


def test_everything_comes_in_order_before_within_and_after() -> None:
    with pipe() as (reads, stream):
        output = PatientOutput(stream)
        output.write("before\n")
        with output:
            for number in range(20):
                output.write(f"{number} µm\n")
        output.write("after\n")
        said = os.read(reads, 10_000).decode().splitlines()
        os.close(reads)
    assert said == ["before", *(f"{number} µm" for number in range(20)), "after"]


def test_a_reader_that_stalls_gets_whole_lines_and_holds_nobody_up() -> None:
    line = "x" * 9_999 + "\n"
    with pipe() as (reads, stream):
        output = PatientOutput(stream)
        with output:
            for _ in range(1000):
                output.write(line)
        output.write("dropped, too\n")
        held = os.read(reads, 100_000).decode()
        os.close(reads)
    assert line * 6 == held[:60_000]
    assert "dropped" not in held


def test_a_reader_that_has_gone_is_told_once() -> None:
    with pipe() as (reads, stream):
        os.close(reads)
        output = PatientOutput(stream)
        with pytest.raises(BrokenPipeError), output:
            output.write("nobody\n")
        output.write("nobody\n")


def test_without_a_stream_all_is_dropped() -> None:
    with PatientOutput(None) as output:
        assert output.write("nobody\n") == 7
        assert not output.isatty()
