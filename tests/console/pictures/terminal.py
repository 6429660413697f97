"""Picture of the terminal view at one time of a real demo."""

import copy
import io
import json
import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import rich.screen
from rich.console import Console

from operator_side.viewing.facts import OperatorFacts
from operator_side.viewing.terminal.screen import Screen
from tests.helpers.repository import ROOT

_COLUMNS, _ROWS = 80, 24
_STIFF: Final = 4
_FONT: Final = re.compile(r"@font-face \{.*?\}", re.DOTALL)
"""Fonts in the SVG of the library Rich: they are removed, as a viewer would load them from the network"""


def make_picture_of_terminal(_: Path, paths: Sequence[Path]) -> None:
    """Run a demo, and write the terminal view as an SVG; AssertionError with the demo's last output if it fails."""
    (path,) = paths
    asked = ("demo", "--no-console", "--status=facts", "--duration=18")
    command = [sys.executable, "-P", "-m", "feelahead", *asked]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300.0, check=False, cwd=ROOT)
    if done.returncode != 0:
        raise AssertionError(f"feelahead demo: {done.stderr.strip()[-300:]}")
    screen = _near([json.loads(line) for line in done.stdout.splitlines()])
    console = Console(record=True, file=io.StringIO(), width=_COLUMNS, height=_ROWS, force_terminal=True)
    console.print(rich.screen.Screen(screen.lines(0.0, _COLUMNS)))
    title = "feelahead demo --tui"
    path.write_text(_FONT.sub("", console.export_svg(title=title, unique_id="terminal")))


def _near(events: Sequence[dict[str, Any]]) -> Screen:
    """Return the terminal view at the last time of the approach at which R2 resists clearly."""
    screen, found = Screen(), None
    for event in events:
        if event["event"] == "note":
            screen.notes.append(event["text"])
        elif event["event"] == "facts":
            facts = msgspec.convert(event["facts"], OperatorFacts)
            screen.add(facts)
            if facts.page is not None and facts.status.person == "advancing" and facts.r2.meets >= _STIFF:
                found = copy.deepcopy(screen)
    if found is None:
        raise AssertionError(f"R2 never met {_STIFF} of 8 on the way to the target")
    return found
