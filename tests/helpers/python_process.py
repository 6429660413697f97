"""Python processes of ours, with their output and errors to be read."""

import os
import subprocess
import sys

from tests.helpers.repository import ROOT

LIMIT_S = 600.0
"""Long enough for a machine that is busy with other things, too."""


def start(*arguments: str, **environment: str) -> "subprocess.Popen[str]":
    """Start Python with these arguments, and more variables of the environment."""
    return subprocess.Popen(
        [sys.executable, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
    )


def ended(*arguments: str, **environment: str) -> tuple[int, str, str]:
    """The exit code of such a process at its end, its output and its errors."""
    with start(*arguments, **environment) as process:
        said, complaint = process.communicate(timeout=LIMIT_S)
    return process.returncode, said, complaint
