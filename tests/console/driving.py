"""Grasp and place by keyboard alone, in a real browser: `python -m tests.console.driving --delays 0 150 300 --seeds 5`.

Real keys are pressed, and only what the page shows is read. The hand acts on what it saw a reaction ago. It moves
and waits: it holds keys for as long as the shown distance needs, and reads again once the outcome can be seen.
"""

import argparse
import csv
import json
import os
import re
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from common.errors import ConfigurationError
from tests.console.browser import Browser, Page, browser
from tests.console.run import running

MOST_S: Final = 90.0
"""Time limit of one run, from the moment when the page drives, in seconds"""
_REACTION_S: Final = 0.25
_RAMP_S: Final = 0.6
"""Time in which a held key's pull rises (docs/console.md)"""
_STICK_MM_S, _TRIGGER_MM_S = 100.0, 250.0
"""Speed at full travel, which a person soon knows from the outcome of the first moves"""
_ALIGNED_MM: Final = 6.0
_CLOSE_MM: Final = 20.0
"""Way of the target's middle behind the gripper's point at which the fingers close"""
_LIFT_MM, _BACK_MM, _GENTLE_MM = 60.0, 60.0, 30.0
_LOST_S: Final = 30.0
COLUMNS: Final = (
    *("delay_ms", "seed", "grasped", "placed", "time_s", "contacts", "amber", "dead"),
    *("changes", "pictures_hz", "drops", "unarmed", "stops", "end"),
)
_SEEN: Final = """() => {
    const text = (selector) => document.querySelector(selector)?.textContent ?? '';
    const rows = [...document.querySelectorAll('.near dt')].map((dt) => [dt.textContent, dt.nextSibling.textContent]);
    return {
        rows: Object.fromEntries(rows), state: document.body.dataset.state, hands: text('#hands_state'),
        delay: text('#delay'), r2: text('#r2 .yields'), off: !document.querySelector('#hands_off').hidden,
        ages: [...document.querySelectorAll('.view')].map((view) => view.dataset.age),
        frames: Number(document.querySelector('.view').dataset.frames ?? 0),
    };
}"""
_DRIVES_OR_LATE: Final = "/You drive|Release all keys/.test(document.querySelector('#hands_state')?.textContent)"


class OutOfTimeError(Exception):
    """The run's time is over."""


class Hand:
    """Person at the page: presses keys, and knows of the robot what the page showed a reaction ago."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._seen: deque[tuple[float, dict[str, Any]]] = deque()
        self._held: set[str] = set()
        self._level = 4
        self.began_s = time.monotonic()
        self.looks = self.amber = self.dead = self.changes = 0
        """Number of looks at the page; and of these, with an old picture, a dead view, another state than before"""
        self.drops = self.unarmed = 0
        """Number of times that keys were released without the hand's doing, and of attempts to arm that failed"""
        self._newest: dict[str, Any] | None = None
        self._first_frames = 0

    def look(self) -> dict[str, Any]:
        """Take in what the page shows; return what it showed a reaction ago. OutOfTimeError at the time limit."""
        time.sleep(0.03)
        now_s = time.monotonic()
        if now_s - self.began_s > MOST_S:
            raise OutOfTimeError
        seen = self._page.ask(_SEEN)
        self.looks += 1
        self.amber += "old" in seen["ages"]
        self.dead += "dead" in seen["ages"]
        self.changes += self._newest is not None and self._newest["ages"] != seen["ages"]
        self._newest = seen
        self._seen.append((now_s, seen))
        while len(self._seen) > 1 and self._seen[1][0] <= now_s - _REACTION_S:
            self._seen.popleft()
        known = self._seen[0][1]
        if "run" in self._held and ("Release all keys" in known["hands"] or known["state"] in ("disarmed", "stopped")):
            self.drops += 1
            self.arm()
            return self.look()
        return known

    def arm(self) -> None:
        """Release all, reset a stop, wait for the page's word, and hold Space until the page drives.

        If keys came late meanwhile, the page asks for the same again.
        """
        keyboard, drives = self._page.raw.keyboard, False
        while not drives:
            if time.monotonic() - self.began_s > MOST_S:
                raise OutOfTimeError
            self.release()
            keyboard.up("Space")
            if self._page.raw.is_visible("#reset"):
                self._page.raw.click("#reset")
            self._page.wait_for_text("#hands_state", "Ready", _LOST_S)
            keyboard.down("Space")
            self._page.wait(_DRIVES_OR_LATE, "'You drive' or 'Release all keys' in #hands_state", _LOST_S)
            drives = "You drive" in self._page.ask(_SEEN)["hands"]
            self.unarmed += not drives
        self._seen.clear()
        self._held.add("run")

    def begin(self) -> None:
        """Count time and pictures from now on."""
        self.began_s, self._first_frames = time.monotonic(), int(self._page.ask(_SEEN)["frames"])

    @property
    def pictures_hz(self) -> float:
        """Number of pictures of the first view that were shown in a second"""
        frames = 0 if self._newest is None else self._newest["frames"] - self._first_frames
        return float(frames / (time.monotonic() - self.began_s))

    def release(self) -> None:
        for key in self._held - {"run"}:
            self._page.raw.keyboard.up(key)
        self._held &= {"run"}

    def hold(self, key: str) -> None:
        self._held.add(key)
        self._page.raw.keyboard.down(key)

    def wait(self, for_s: float, until: Callable[[dict[str, Any]], object] = lambda _: False) -> dict[str, Any]:
        """Look for `for_s`, or until `until` holds; return what was seen last."""
        end_s = time.monotonic() + for_s
        while not until(seen := self.look()) and time.monotonic() < end_s:
            pass
        return seen

    def settle(self) -> dict[str, Any]:
        """Wait until the outcome of the last move can be seen and the pictures are fresh; return what is seen then."""
        delays_ms = [float(figure) for figure in re.findall(r"[0-9.]+", self._seen[-1][1]["delay"])]
        seen = self.wait(1e-3 * sum(delays_ms) + _REACTION_S + 0.3)  # the last 0.3 s for the arm and the figures
        return self.wait(_LOST_S, lambda one: not one["off"]) if seen["off"] else seen

    def move(self, level: int, ways_mm: Mapping[str, float], until: Callable[[dict[str, Any]], object]) -> None:
        """Hold each key for as long as its way needs at this level of travel; let all go as soon as `until` holds."""
        if level != self._level:
            self._page.press(f"Digit{level}")
            self._level = level
        began_s = time.monotonic()
        ends = {key: began_s + _held_s(way_mm, key, level) for key, way_mm in ways_mm.items() if way_mm > 0.0}
        for key in ends:
            self.hold(key)
        while ends and not until(self.look()):
            for key in [key for key, end_s in ends.items() if time.monotonic() >= end_s]:
                self._page.raw.keyboard.up(key)
                self._held.discard(key)
                del ends[key]
        self.release()


def _held_s(way_mm: float, key: str, level: int) -> float:
    """Return how long a key is held for a way: the speed rises to its level, and falls at once."""
    speed_mm_s = level / 9 * (_TRIGGER_MM_S if key in ("KeyW", "KeyS") else _STICK_MM_S)
    ramp_mm = 0.5 * speed_mm_s * _RAMP_S
    return _RAMP_S * float((way_mm / ramp_mm) ** 0.5) if way_mm < ramp_mm else way_mm / speed_mm_s + 0.5 * _RAMP_S


def _middle_mm(seen: Mapping[str, Any]) -> tuple[float, float, float] | None:
    """Return the shown way of the target's middle: right, up and ahead; None if it is not shown."""
    words = re.findall(r"(\d+) (right|left|up|down|ahead|behind)", seen["rows"].get("middle", ""))
    if len(words) != len(("right", "up", "ahead")):
        return None
    right, up, ahead = (float(mm) * (1 if side in ("right", "up", "ahead") else -1) for mm, side in words)
    return right, up, ahead


def _height_mm(seen: Mapping[str, Any]) -> float | None:
    found = re.match(r"(\d+) mm", seen["rows"].get("height", ""))
    return None if found is None else float(found[1])


def _yields(seen: Mapping[str, Any]) -> bool:
    return "yields" in seen["r2"]


def _holds(seen: Mapping[str, Any]) -> bool:
    return "holding" in seen["rows"]


def _across(right_mm: float, up_mm: float) -> dict[str, float]:
    return {"KeyD": right_mm, "KeyA": -right_mm, "KeyR": up_mm, "KeyF": -up_mm}


def approach(hand: Hand) -> None:
    """Bring the target's middle between the fingers: across first, then ahead, slowly near it."""
    while True:
        seen = hand.settle()
        if (middle := _middle_mm(seen)) is None:
            continue
        right, up, ahead = middle
        left_mm = ahead + _CLOSE_MM
        off_mm = max(abs(right), abs(up))
        if off_mm < _ALIGNED_MM and left_mm < _ALIGNED_MM:
            return
        if off_mm >= _ALIGNED_MM:
            hand.move(4, _across(right, up), lambda _: False)
        else:
            far = left_mm > 2.0 * _GENTLE_MM
            way_mm = left_mm - _GENTLE_MM if far else left_mm
            # Where the trigger resists, only a gentle pull goes on.
            hand.move(4 if far else 1, {"KeyW": way_mm}, _yields if far else lambda _: False)
            if far and _yields(hand.settle()):
                hand.move(1, {"KeyW": min(way_mm, _GENTLE_MM)}, lambda _: False)


def grasp(hand: Hand) -> bool:
    hand.hold("KeyC")
    hand.wait(4.0, _holds)
    return _holds(hand.settle())


def place(hand: Hand) -> None:
    """Lift, draw back, lower until the page says that it stands, and let go. The gripper's key stays down meanwhile."""
    start_mm = _height_mm(hand.settle()) or 0.0

    def leg(key: str, level: int, way_mm: float, until: Callable[[dict[str, Any]], object]) -> None:
        hand.move(level, {key: way_mm}, until)
        hand.hold("KeyC")

    leg("KeyR", 6, _LIFT_MM, lambda seen: (_height_mm(seen) or 0.0) - start_mm > _LIFT_MM)
    hand.settle()
    leg("KeyS", 2, _BACK_MM, lambda _: False)
    while _holds(seen := hand.settle()) and "stands" not in seen["rows"]["holding"]:
        height_mm = _height_mm(seen) or 0.0
        near = height_mm < _GENTLE_MM
        way_mm = max(0.4 * _GENTLE_MM, height_mm) if near else height_mm - 0.7 * _GENTLE_MM
        leg("KeyF", 2 if near else 5, way_mm, lambda seen: "stands" in seen["rows"].get("holding", "stands"))
    while _holds(hand.settle()):
        hand.release()
        hand.hold("KeyO")
        hand.wait(3.0, lambda seen: not _holds(seen))
    hand.release()


def drive(page: Page) -> tuple[Hand, str]:
    """Do the whole task at the page; return the hand, and how it ended."""
    hand = Hand(page)
    try:
        page.wait("document.querySelector('#drive:enabled') !== null", "a button to drive by", 60.0)
        page.raw.click("#drive")
        page.wait("document.querySelector('.near dt') !== null", "figures beside the gripper", 60.0)
        hand.arm()
        hand.begin()
        hand.look()
        for _ in range(3):
            approach(hand)
            if grasp(hand):
                place(hand)
                return hand, "done"
            hand.release()
            hand.hold("KeyO")
            hand.move(4, {"KeyS": 2.0 * _GENTLE_MM}, lambda _: False)
        return hand, "gave up"
    except OutOfTimeError:
        return hand, "out of time"
    except AssertionError as error:
        return hand, str(error).splitlines()[0]
    finally:
        hand.release()
        page.raw.keyboard.up("Space")


def run_once(one: Browser, delay_ms: float, seed: int, given: Sequence[str]) -> dict[str, object]:
    """Start a demo with this delay each way, this seed and the `given` flags; drive it, and return its row."""
    with tempfile.TemporaryDirectory(prefix="feelahead-") as folder:
        summary, idle = Path(folder) / "summary.json", Path(folder) / "idle.toml"
        idle.write_text("pull_n = 0.0\n")  # the scripted person does nothing
        link = ("--link", f"delay {delay_ms:g}ms") if delay_ms else ()
        with (
            running(
                [*link, "--seed", str(seed), "--summary", str(summary), "--operator-config", str(idle), *given]
            ) as run,
            one.page(run.address) as page,
        ):
            hand, end = drive(page)
            took_s, pictures_hz = time.monotonic() - hand.began_s, hand.pictures_hz
        truth = json.loads(summary.read_text())
    task = truth["task"]
    return {
        "delay_ms": delay_ms,
        "seed": seed,
        "grasped": task["time_to_grasp_s"] is not None,
        "placed": task["placing"]["placed"],
        "time_s": round(took_s, 1),
        "contacts": task["obstacle_contacts"],
        "amber": round(hand.amber / max(hand.looks, 1), 3),
        "dead": round(hand.dead / max(hand.looks, 1), 3),
        "changes": hand.changes,
        "pictures_hz": round(pictures_hz, 1),
        "drops": hand.drops,
        "unarmed": hand.unarmed,
        "stops": len(truth["stops"]),
        "end": end,
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a row for each run as it ends, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--delays", type=float, nargs="+", default=[0.0, 150.0, 300.0], help="milliseconds each way")
    parser.add_argument("--seeds", type=int, default=5, help="number of runs at each delay, with seeds from 0")
    parser.add_argument("--csv", type=Path, help="file for the rows")
    parser.add_argument("--demo", nargs=argparse.REMAINDER, default=[], help="flags for feelahead demo; the last ones")
    asked = parser.parse_args(arguments)
    try:
        with (
            Path(os.devnull if asked.csv is None else asked.csv).open("w", newline="") as file,
            browser(Path("console-pictures").absolute()) as one,
        ):
            table = csv.DictWriter(file, COLUMNS)
            table.writeheader()
            print(*COLUMNS, sep="\t", flush=True)
            for delay_ms in asked.delays:
                for seed in range(asked.seeds):
                    row = run_once(one, delay_ms, seed, asked.demo)
                    print(*row.values(), sep="\t", flush=True)
                    table.writerow(row)
                    file.flush()
    except (ConfigurationError, OSError) as error:
        parser.error(str(error))
    return 0


if __name__ == "__main__":
    sys.exit(main())
