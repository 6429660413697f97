"""Rules for every test: no test fails because the machine is slow, and only marked tests may start a process."""

import os
import sys
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from common.command.launch import single_threaded_algebra
from tests.helpers.repository import ROOT

# The same examples each time, however long the machine takes for one.
settings.register_profile("here", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("here")

single_threaded_algebra()

STARTS = {"subprocess.Popen", "os.fork", "os.posix_spawn"}
FONTS = "fc-list"
"""Program that matplotlib runs once on each machine, before its first figure; any test may start it"""
TRIAL = ROOT / "robot_side" / "drivers" / "mujoco" / "brought" / "trial.py"
"""File that tries each model that is brought in a fork; any test may bring one"""
unmarked: list[str] = []
"""Name of the running test if it has neither marker, `processes` nor `install`; otherwise empty"""


def _is_allowed(arguments: tuple[Any, ...]) -> bool:
    """Return whether any test may start this process: the list of fonts, or the trial of a model that it brings."""
    return arguments[:1] == (FONTS,) or sys._getframe(2).f_code.co_filename == str(TRIAL)


def refuse_processes(event: str, arguments: tuple[Any, ...]) -> None:
    if unmarked and event in STARTS and not _is_allowed(arguments):
        raise AssertionError(f"{unmarked[0]} starts a process and carries neither marker, processes nor install")


sys.addaudithook(refuse_processes)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the longest tests begin first, so that no worker is left alone with one of them in the end."""
    items.sort(key=lambda item: not any(map(item.get_closest_marker, ("processes", "install", "long"))))


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Print a failure when it happens: a run that is ended from outside never comes to its summary."""
    if report.failed and "PYTEST_XDIST_WORKER" not in os.environ:
        crash = getattr(report.longrepr, "reprcrash", None)
        why = report.longreprtext.strip().splitlines()[-1] if crash is None else crash.message
        sys.stdout.write(f"\n{report.nodeid} ({report.when}): {why}\n")
        sys.stdout.flush()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    if item.get_closest_marker("processes") is None and item.get_closest_marker("install") is None:
        unmarked.append(item.nodeid)
    try:
        return (yield)
    finally:
        unmarked.clear()
