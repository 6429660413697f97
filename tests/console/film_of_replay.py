"""Film of the console's page: replays a recorded demo and takes one picture after another, even on a slow machine."""

import io
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final

import msgspec
from PIL import Image

from common.recording.reading import open_recording
from feelahead.recordings.playback import FACTS, VIEW, Playback
from operator_side.viewing.console.console import Console
from operator_side.viewing.facts import OperatorFacts
from tests.console.browser import Page, browser
from tests.console.pictures_of_recording import record_demo
from tests.helpers.machines.waiting import wait_until

_DURATION_S: Final = 20.0
_PERIOD_S: Final = 0.1
_DRAWN_S: Final = 0.3
"""Seconds that the scene gets to draw: as another site's page, it cannot be asked whether it has finished"""
_START_S: Final = 60.0
_SIZE: Final = (960, 540)
_QUALITY: Final = 40
_HAS_GRAPHICS: Final = """
const asked = WebGLRenderingContext.prototype.getParameter;
WebGLRenderingContext.prototype.getParameter = function (name) {
  return name === 0x9246 ? "patient" : asked.call(this, name);
};
"""
"""Script that makes the page believe in a graphics processor.

Without one, the page would draw the scene only four times a second. A film has time for every drawing.
"""


def make_film(folder: Path, paths: Sequence[Path]) -> None:
    """Record 20 s of a demo, and film its replay at 10 pictures a second, as a WebP."""
    (path,) = paths
    recording = folder / "film.mcap"
    record_demo(recording, _DURATION_S)
    with browser(folder) as one, Console("film", live=False) as console:
        _until(console, lambda: console.address is not None)
        with one.page(str(console.address), scene=True, script=_HAS_GRAPHICS) as page:
            _until(console, lambda: console.pages > 0)
            pictures = list(_pictures(console, page, Playback(open_recording(recording))))
    first, *others = pictures
    duration_ms = round(1e3 * _PERIOD_S)
    first.save(path, save_all=True, append_images=others, duration=duration_ms, loop=0, quality=_QUALITY, method=4)


def _pictures(console: Console, page: Page, playback: Playback) -> Iterator[Image.Image]:
    facts = msgspec.json.Decoder(OperatorFacts)
    playback.paused = False
    while not playback.over:
        for seen in playback.advance(_PERIOD_S):
            if seen.kind == FACTS:
                console.facts(facts.decode(seen.content))
            elif seen.kind == VIEW:
                console.view(seen.content, video=False)
        console.played(playback.state())
        page.wait_for_text("#player", f"{playback.at_s:.1f} of")
        time.sleep(_DRAWN_S)
        console.receive()
        with Image.open(io.BytesIO(page.shot())) as whole:
            yield whole.convert("RGB").resize(_SIZE, Image.Resampling.LANCZOS)


def _until(console: Console, holds: Callable[[], bool]) -> None:
    def received() -> bool:
        console.receive()
        assert not console.gone
        return holds()

    wait_until("a page of the console", received, _START_S, instead=console.take_notes)
