"""Rules for every test: a busy machine's timing fails none, and a test that starts a process carries the marker."""

import sys
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

# The same examples each time, however long the machine takes for one.
settings.register_profile("here", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("here")

STARTS = {"subprocess.Popen", "os.fork", "os.posix_spawn"}
FONTS = "fc-list"
"""Program that matplotlib runs before its first figure on a machine."""
KERNELS = "robot_side.compiled.helper_processes"
"""Module that compiles the kernels before the first test that needs them on a machine."""
unmarked: list[str] = []
"""Name of the running test, unless it carries the marker."""


def refuse_processes(event: str, arguments: tuple[Any, ...]) -> None:
    if unmarked and event in STARTS and arguments[0] != FONTS and KERNELS not in arguments[1]:
        raise AssertionError(f"{unmarked[0]} starts a process and carries neither marker, processes nor install")


sys.addaudithook(refuse_processes)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    if item.get_closest_marker("processes") is None and item.get_closest_marker("install") is None:
        unmarked.append(item.nodeid)
    try:
        return (yield)
    finally:
        unmarked.clear()
