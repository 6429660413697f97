"""Pictures of the console's page in a real browser, as a person sees it during `make demo`."""

import base64
import io
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from PIL import Image

from tests.console.browser import Page, browser
from tests.console.run import Run, running
from tests.console.stage import DRAWN
from tests.containers.debian import Say
from tests.containers.watch import check

_COLORS: Final = 256
_SIZE: Final = (800, 450)
_MOVING_S: Final = 20.0
_PERIOD_S: Final = 0.25
_QUALITY: Final = 60
_STIFF: Final = 1
_MEETS: Final = "parseInt(document.querySelector('#r2 .meets').textContent.match(/[0-9]+/)[0])"
_FRESH: Final = f"{DRAWN} && document.querySelector('.view.old') === null"
_CALM_S: Final = 1.0
_SETTLES_S: Final = 60.0
_LOOK_S: Final = 0.1
_FRAMES: Final = "Object.fromEntries([...document.querySelectorAll('.view')].map((v) => [v.id, +v.dataset.frames]))"
_DRAWING: Final = """async (seconds) => {
    const began = performance.now();
    let drawn = 0;
    for (; performance.now() - began < 1000 * seconds; drawn++) await new Promise(requestAnimationFrame);
    return 1000 * drawn / (performance.now() - began);
}"""


def make_first_minute(program: str, folder: Path, paths: Sequence[Path], say: Say) -> None:
    """Open, near the target, carrying, driven from the page, stopped: five PNG of 1280x720."""
    opened, near, carrying, driving, stopped = paths
    with browser(program, folder) as one, running(()) as run, one.page(run.address, scene=True) as page:
        _settle(page)
        _keep(page, folder, opened)
        _keep_stiffest(page, run, folder, near)
        run.wait_until("carrying", lambda run: _doing(run) == "carrying", 60.0)
        _keep(page, folder, carrying)
        say(f"drawn {page.ask(_DRAWING, 3.0):.0f} times a second")
    # Without a graphics processor the drawn scene takes what both sides need.
    with browser(program, folder) as one, running(()) as run, one.page(run.address) as page:
        run.wait_until("armed", lambda run: run.status.get("state") == "armed", 60.0)
        page.raw.click("#drive")
        page.wait_for_text("#hands_state", "Ready")
        with page.held("Space"):
            page.wait_for_text("#hands_state", "You drive")
            with page.held("KeyW"):
                time.sleep(0.7)
                _keep(page, folder, driving)
                page.press("Escape")
                page.wait_for_text("#state", "stopped")
        page.wait_for_text("#hands_stopped", "STOPPED")
        _keep(page, folder, stopped)


def make_moving_picture(program: str, folder: Path, path: Path, say: Say) -> None:
    """The page from the moment when the arm is armed, as an animated WebP."""
    with browser(program, folder) as one, running(()) as run, one.page(run.address) as page:
        _settle(page)
        run.wait_until("armed", lambda run: run.status.get("state") == "armed", 60.0)
        before, began_s = page.ask(_FRAMES), time.monotonic()
        frames = _recorded(page, _MOVING_S)
        took_s, after = time.monotonic() - began_s, page.ask(_FRAMES)
    rates = ", ".join(f"{name} {(after[name] - before[name]) / took_s:.0f}" for name in after)
    say(f"Chromium gave {len(frames) / took_s:.1f} pictures of the page a second; the cameras' drawn: {rates}")
    chosen = _even(frames)
    images = [Image.open(io.BytesIO(frame)).convert("RGB").resize(_SIZE, Image.Resampling.LANCZOS) for frame in chosen]
    images[0].save(
        path,
        save_all=True,
        append_images=images[1:],
        duration=round(1000 * _PERIOD_S),
        loop=0,
        quality=_QUALITY,
        method=6,
    )


def _settle(page: Page) -> None:
    """Let the person wait until all is drawn, which takes long without a graphics processor; then they go on."""
    page.wait("document.querySelector('#drive:enabled') !== null", "a button to drive by", 60.0)
    page.ask("document.querySelector('#drive').click()")
    page.wait("!document.querySelector('#give_back').hidden", "the person's hands off", 60.0)
    if page.ask("document.querySelector('#drawn').ariaPressed") == "true":
        page.wait("!document.querySelector('#scene iframe').hidden", "a scene", 60.0)
    calm_since_s = began_s = time.monotonic()
    while time.monotonic() - calm_since_s < _CALM_S:
        check(time.monotonic() - began_s < _SETTLES_S, f"no calm {_CALM_S:g} s within {_SETTLES_S:g} s")
        if not page.ask(_FRESH):
            calm_since_s = time.monotonic()
        time.sleep(_LOOK_S)
    page.ask("document.querySelector('#give_back').click()")


def _recorded(page: Page, for_s: float) -> list[tuple[float, bytes]]:
    """Chromium's own screencast: when each was drawn on its clock, and the JPEG."""
    tools, frames = page.raw.context.new_cdp_session(page.raw), []

    def take(frame: dict[str, Any]) -> None:
        tools.send("Page.screencastFrameAck", {"sessionId": frame["sessionId"]})
        frames.append((float(frame["metadata"]["timestamp"]), base64.b64decode(frame["data"])))

    tools.on("Page.screencastFrame", take)
    tools.send("Page.startScreencast", {"format": "jpeg", "quality": 92})
    page.raw.wait_for_timeout(1000.0 * for_s)
    tools.send("Page.stopScreencast")
    check(len(frames) > 1, "Chromium drew nothing")
    return frames


def _even(frames: Sequence[tuple[float, bytes]]) -> list[bytes]:
    """The newest at each step of time."""
    steps = round(_MOVING_S / _PERIOD_S)
    began_s = frames[0][0]
    return [max(one for one in frames if one[0] <= began_s + step * _PERIOD_S)[1] for step in range(steps)]


def _keep_stiffest(page: Page, run: Run, folder: Path, path: Path) -> None:
    """Of the approach, the moment when R2 resists most: looks are too slow to wait for one."""
    most = 0
    run.wait_until("near", lambda run: max(run.facts[-1]["r2"]["zones"]) > 0, 60.0)
    while _doing(run) in ("advancing", "grasping"):
        meets = int(page.ask(_MEETS))
        if meets > most:
            most = meets
            _keep(page, folder, path)
        run.look()
    check(most >= _STIFF, f"R2 met {most} of 8 on the way to the target")


def _doing(run: Run) -> str:
    return str(run.facts[-1]["page"]["doing"])


def _keep(page: Page, folder: Path, path: Path) -> None:
    """What is seen now, in few colours."""
    page.picture(path.stem)
    with Image.open(folder / path.name) as whole:
        whole.convert("RGB").quantize(_COLORS, dither=Image.Dither.NONE).save(path, optimize=True)
