import contextlib
import os
import threading
from collections.abc import Iterator
from typing import TextIO

import pytest

from common.command.patient_output import PatientOutput


@contextlib.contextmanager
def pipe() -> Iterator[tuple[int, TextIO]]:
    reads, writes = os.pipe()
    with os.fdopen(writes, "w", encoding="utf-8") as stream:
        yield reads, stream


class Reader(threading.Thread):
    def __init__(self, descriptor: int) -> None:
        super().__init__(daemon=True)
        self._descriptor = descriptor
        self.said: list[str] = []

    def run(self) -> None:
        with os.fdopen(self._descriptor, encoding="utf-8") as stream:
            self.said = stream.read().splitlines()


def test_a_reader_that_pauses_gets_the_newest_lines_and_every_result() -> None:
    with pipe() as (reads, stream):
        reader = Reader(reads)
        output = PatientOutput(stream)
        with output:
            for number in range(1000):
                output.write(f"{number} {9_999 * 'x'}\n")
        reader.start()  # So late that the output has given up to wait for a reader.
        for number in range(12):
            output.write(f"result {number}\n")
    reader.join(600)
    assert reader.said[-12:] == [f"result {number}" for number in range(12)]
    numbers = [int(line.split()[0]) for line in reader.said[:-12]]
    assert numbers == sorted(set(numbers))
    assert numbers[-1] == 999


def test_an_output_that_blocks_nobody_is_waited_for() -> None:
    with pipe() as (reads, stream):
        os.set_blocking(stream.fileno(), False)
        reader = Reader(reads)
        output = PatientOutput(stream)
        with output:
            for _ in range(60):
                output.write("x" * 9_999 + "\n")
        reader.start()
        output.write("result\n")
    reader.join(600)
    assert reader.said == ["x" * 9_999] * 60 + ["result"]


def test_a_reader_that_has_gone_is_told_once_by_a_later_write() -> None:
    def write_on() -> None:
        while True:
            output.write("nobody\n")

    with pipe() as (reads, stream):
        os.close(reads)
        output = PatientOutput(stream)
        with output:
            with pytest.raises(BrokenPipeError):
                write_on()
            output.write("nobody\n")
        output.write("nobody\n")
