"""Two machines on a cable for tests, which are skipped where the system grants none."""

import contextlib
from collections.abc import Iterator

import pytest

from feelahead.lab.faults import two_machines as cable
from feelahead.lab.faults.two_machines import Machine, NotPermittedError

__all__ = ["Machine", "two_machines"]


@contextlib.contextmanager
def two_machines(*addresses: str) -> Iterator[tuple[Machine, Machine]]:
    """Yield the robot's and the operator's machine; skip the test where they cannot be had."""
    with contextlib.ExitStack() as stack:
        try:
            machines = stack.enter_context(cable.two_machines(*addresses))
        except NotPermittedError as error:
            pytest.skip(str(error))
        yield machines
