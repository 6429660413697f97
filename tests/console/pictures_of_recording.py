"""Pictures of a recorded demo: its plot, and the terminal view at one time of the run."""

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
from PIL import Image
from rich.console import Console

from operator_side.viewing.facts import OperatorFacts
from operator_side.viewing.terminal.screen import Screen
from tests.helpers.repository import ROOT

_DURATION_S: Final = 18.0
_LIMIT_S: Final = 300.0
_COLUMNS, _ROWS = 80, 24
_COLORS: Final = 256
_STIFF: Final = 4
_FONT: Final = re.compile(r"@font-face \{.*?\}", re.DOTALL)
"""Fonts in the SVG of the library Rich: they are removed, as a viewer would load them from the network"""


def make_pictures_of_recording(folder: Path, paths: Sequence[Path]) -> None:
    """Run a demo and record it in `folder`; write the terminal view as an SVG, and the plot of the run as a PNG."""
    terminal, plot = paths
    recording, drawn = folder / "demo.mcap", folder / "demo.png"
    events = record_demo(recording, _DURATION_S)
    _draw_terminal(_near(events), terminal)
    _feelahead("plot", str(recording), f"--out={drawn}")
    with Image.open(drawn) as whole:
        whole.convert("RGB").quantize(_COLORS, dither=Image.Dither.NONE).save(plot, optimize=True)


def record_demo(recording: Path, duration_s: float) -> list[dict[str, Any]]:
    """Run a demo for `duration_s`; return its events."""
    recording.unlink(missing_ok=True)
    asked = ("--no-console", "--status=facts", f"--duration={duration_s}", f"--record={recording}")
    return [json.loads(line) for line in _feelahead("demo", *asked).splitlines()]


def _feelahead(*arguments: str) -> str:
    """Run a `feelahead` command and return its output; AssertionError with its last output if it fails."""
    command = [sys.executable, "-P", "-m", "feelahead", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT_S, check=False, cwd=ROOT)
    if done.returncode != 0:
        raise AssertionError(f"feelahead {arguments[0]}: {done.stderr.strip()[-300:]}")
    return done.stdout


def _near(events: Sequence[dict[str, Any]]) -> Screen:
    """Return the terminal view at the last time of the approach at which R2 resists clearly."""
    # A recording holds the operator side's view alone; a demo's terminal view gets the facts of both sides.
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


def _draw_terminal(screen: Screen, path: Path) -> None:
    """Write the terminal view as an SVG."""
    console = Console(record=True, file=io.StringIO(), width=_COLUMNS, height=_ROWS, force_terminal=True)
    console.print(rich.screen.Screen(screen.lines(0.0, _COLUMNS)))
    title = "feelahead demo --tui"
    path.write_text(_FONT.sub("", console.export_svg(title=title, unique_id="terminal")))
