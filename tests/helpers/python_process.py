"""Python processes whose output and errors a test can read."""

import os
import subprocess
import sys

from tests.helpers.machines.waiting import LIMIT_S
from tests.helpers.repository import ROOT


def start(*arguments: str, **environment: str) -> "subprocess.Popen[str]":
    """Start Python with these arguments and additional environment variables."""
    return subprocess.Popen(
        [sys.executable, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | environment,
    )


def ended(*arguments: str, **environment: str) -> tuple[int, str, str]:
    """Start Python as `start` does and wait for its end; return its exit code, output and errors."""
    with start(*arguments, **environment) as process:
        said, complaint = process.communicate(timeout=LIMIT_S)
    return process.returncode, said, complaint
