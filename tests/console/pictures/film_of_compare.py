"""Film of the page of `feelahead demo --compare`: one picture after another, even on a slow machine."""

import io
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from feelahead.commands.demo.compare import compute, page_of
from feelahead.commands.demo.settings import DemoSettings
from tests.console.browser import SMALL, browser

_FROM_S, _UNTIL_S, _PERIOD_S = 1.5, 21.5, 0.1


def make_compare_film(folder: Path, paths: Sequence[Path]) -> None:
    """Compare seed 0 at 200 ms each way, and film the page at 10 pictures a second, as a WebP."""
    (path,) = paths
    settings = DemoSettings(compare=True, link="delay 200ms")
    page_file = folder / "compare.html"
    page_file.write_text(page_of(settings, compute(settings, pictures=True)), encoding="utf-8")
    pictures = []
    with browser(folder) as one, one.page(page_file.as_uri(), SMALL) as page:
        page.ask("play(false)")
        for time_s in np.arange(_FROM_S, _UNTIL_S, _PERIOD_S):
            page.ask(f"show({time_s})")
            time.sleep(0.1)
            with Image.open(io.BytesIO(page.shot())) as whole:
                pictures.append(whole.convert("RGB").resize((960, 540), Image.Resampling.LANCZOS))
    first, *others = pictures
    duration_ms = round(1e3 * _PERIOD_S)
    first.save(path, save_all=True, append_images=others, duration=duration_ms, loop=0, quality=40, method=4)
