"""Pictures of a recorded demo: its plot, and the terminal view at one of its moments."""

import copy
import io
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import rich.screen
from PIL import Image
from rich.console import Console
from rich.terminal_theme import TerminalTheme

from operator_side.facts import OperatorFacts
from operator_side.terminal_view.screen import Screen
from tests.containers.debian import Say
from tests.containers.watch import CheckFailedError
from tests.helpers.repository import ROOT

_DURATION_S: Final = 18.0
_LIMIT_S: Final = 300.0
_COLUMNS, _ROWS = 80, 24
_COLORS: Final = 256
_STIFF: Final = 4
_DARK, _LIGHT = (12, 12, 12), (229, 229, 229)
_NORMAL: Final = [_DARK, (205, 49, 49), (13, 188, 121), (229, 229, 16), (36, 114, 200), (188, 63, 188), (17, 168, 205)]
_BRIGHT: Final = [
    (130, 130, 130),
    (241, 76, 76),
    (35, 209, 139),
    (245, 245, 67),
    (59, 142, 234),
    (214, 112, 214),
    (41, 219, 255),
]
_THEME: Final = TerminalTheme((24, 24, 24), _LIGHT, [*_NORMAL, _LIGHT], [*_BRIGHT, (255, 255, 255)])
_FORMAT: Final = """<svg viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg">
<style>
.{unique_id}-matrix {{ font-family: "DejaVu Sans Mono", monospace; font-size: {char_height}px; }}
.{unique_id}-title {{ font-family: sans-serif; font-size: 18px; font-weight: bold; }}
{styles}
</style>
<defs>
<clipPath id="{unique_id}-clip-terminal"><rect width="{terminal_width}" height="{terminal_height}"/></clipPath>
{lines}
</defs>
{chrome}
<g transform="translate({terminal_x}, {terminal_y})" clip-path="url(#{unique_id}-clip-terminal)">
{backgrounds}
<g class="{unique_id}-matrix">
{matrix}
</g>
</g>
</svg>
"""
"""Rich's own would load fonts from elsewhere."""


def make_pictures_of_recording(folder: Path, paths: Sequence[Path], say: Say) -> None:
    """Run and record a demo in `folder`, and draw it: the terminal view as an SVG, and its plot as a PNG."""
    terminal, plot = paths
    recording, drawn = folder / "demo.mcap", folder / "demo.png"
    events = record_demo(recording, _DURATION_S)
    say("a demo is recorded")
    _draw_terminal(_near(events), terminal)
    _feelahead("plot", str(recording), f"--out={drawn}")
    with Image.open(drawn) as whole:
        whole.convert("RGB").quantize(_COLORS, dither=Image.Dither.NONE).save(plot, optimize=True)


def record_demo(recording: Path, duration_s: float) -> list[dict[str, Any]]:
    """Run a demo for so long; what it said."""
    recording.unlink(missing_ok=True)
    asked = ("--no-console", "--status=facts", f"--duration={duration_s}", f"--record={recording}")
    return [json.loads(line) for line in _feelahead("demo", *asked).splitlines()]


def _feelahead(*arguments: str) -> str:
    """What it wrote; CheckFailedError with its last words where it failed."""
    command = [sys.executable, "-P", "-m", "feelahead", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=_LIMIT_S, check=False, cwd=ROOT)
    if done.returncode != 0:
        raise CheckFailedError(f"feelahead {arguments[0]}: {done.stderr.strip()[-300:]}")
    return done.stdout


def _near(events: Sequence[dict[str, Any]]) -> Screen:
    """The terminal view at the last moment of the approach when R2 resists clearly."""
    # What a recording holds is the operator side's alone; the terminal view of a demo is told what both sides know.
    screen, found = Screen(), None
    for event in events:
        if event["event"] == "note":
            screen.notes.append(event["text"])
        elif event["event"] == "facts":
            facts = msgspec.convert(event["facts"], OperatorFacts)
            screen.add(facts)
            if facts.page is not None and facts.page.doing == "advancing" and facts.r2.meets >= _STIFF:
                found = copy.deepcopy(screen)
    if found is None:
        raise CheckFailedError(f"R2 never met {_STIFF} of 8 on the way to the target")
    return found


def _draw_terminal(screen: Screen, path: Path) -> None:
    """Write the screen as an SVG."""
    console = Console(record=True, file=io.StringIO(), width=_COLUMNS, height=_ROWS, force_terminal=True)
    console.print(rich.screen.Screen(screen.lines(0.0, _COLUMNS, _ROWS)))
    title = "feelahead demo --tui"
    path.write_text(console.export_svg(title=title, theme=_THEME, code_format=_FORMAT, unique_id="terminal"))
