"""Attack every port of a robot side with keys for some minutes, and measure what an honest operator has of it.

python -m tests.soak --seconds 600 [--without KIND ...]
"""

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any, Final

from common.sockets.authentication import make_key_pair
from common.sockets.key_files import KeyRole
from common.sockets.keys import KeyFolder
from feelahead.both_sides.processes import SideProcess
from tests.helpers.repository import ROOT

ATTACKS: Final[tuple[tuple[str, str, KeyRole | None], ...]] = (
    *(("strangers", port, None) for port in ("--bind", "view", "--arm", "--objects", "--pictures")),
    ("tiny", "--bind", "operator"),
    ("endless", "--bind", "operator"),
    ("subscriptions", "view", "observer"),
    ("tiny", "view", "observer"),
    ("lying", "--arm", "operator"),
    ("lying", "--arm", "driver"),
    ("tiny", "--arm", "driver"),
    ("large", "--objects", "perception"),
    ("endless", "--objects", "perception"),
    ("wordy", "--objects", "perception"),
    *((kind, "--pictures", "perception") for kind in ("tiny", "large", "endless", "wordy")),
)
"""Kind, port, and role of the key; None without a key"""
ARMED_SHARE: Final = 0.95
GROWTH_BYTES: Final = 20_000_000
_SETTLES_S: Final = 20.0


def keys(folder: Path) -> dict[str, str]:
    """Make a robot's folder of keys, in which each attacker and each honest program has a role; return its names."""
    robot, (public, secret) = KeyFolder(folder / "robot"), make_key_pair()
    robot.write_pair("robot", public, secret)
    roles: dict[str, KeyRole] = {"anna": "operator", "arm": "driver", "camera": "perception"}
    roles |= {f"mallory-{number}": role for number, (_, _, role) in enumerate(ATTACKS) if role is not None}
    for name, role in roles.items():
        theirs, own = make_key_pair()
        KeyFolder(folder / name).write_pair("operator", theirs, own)
        robot.allow(name, theirs, role)
    return {"robot": public}


def resident_bytes(process_id: int) -> int:
    """Return the memory of a process; 0 once it has ended."""
    with contextlib.suppress(OSError, IndexError):
        return int(Path(f"/proc/{process_id}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    return 0


def descriptors(process_id: int) -> int:
    """Return the number of a process's descriptors."""
    with contextlib.suppress(OSError):
        return len(list(Path(f"/proc/{process_id}/fd").iterdir()))
    return 0


def door_of(process_id: int) -> int:
    """Return the process that owns the ports of a robot side; 0 while there is none."""
    for child in Path(f"/proc/{process_id}/task/{process_id}/children").read_text().split():
        with contextlib.suppress(OSError):
            if b"door.keeper" in Path(f"/proc/{child}/cmdline").read_bytes():
                return int(child)
    return 0


def main() -> int:
    """Run the soak, and print what was asked and measured; return 1 if something asked was not held."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--without", nargs="*", default=[], metavar="KIND", help="attacks to leave out")
    parser.add_argument("--simulated", action="store_true", help="a simulated arm and camera: no --arm, no --objects")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place, contextlib.ExitStack() as stack:
        folder = Path(place)
        public, summary = keys(folder)["robot"], folder / "summary.json"
        drivers = [] if asked.simulated else ["--arm=tcp://127.0.0.1:5601", "--objects=tcp://127.0.0.1:5602"]
        ports = {"--bind": "tcp://127.0.0.1:5600", "view": "tcp://127.0.0.1:5603", "--pictures": "tcp://127.0.0.1:5604"}
        ports |= {} if asked.simulated else {"--arm": "tcp://127.0.0.1:5601", "--objects": "tcp://127.0.0.1:5602"}
        given = [f"--bind={ports['--bind']}", f"--view-bind={ports['view']}", f"--keys={folder / 'robot'}"]
        given += [
            f"--pictures={ports['--pictures']}",
            f"--summary={summary}",
            f"--audit={folder / 'audit.jsonl'}",
            *drivers,
        ]
        robot = stack.enter_context(SideProcess("robot_side", "robot", given))

        def start(*words: str) -> None:
            process = subprocess.Popen([sys.executable, "-P", "-m", *words], stdout=subprocess.DEVNULL, cwd=ROOT)
            stack.callback(process.wait)
            stack.callback(process.kill)

        if not asked.simulated:
            for script, port, name in (
                ("example_arm.py", "--arm", "arm"),
                ("example_objects.py", "--objects", "camera"),
            ):
                start("tests.soak.honest", str(ROOT / "docs" / "drivers" / script), ports[port], str(folder), name)
        robot.wait_for("listening", 300.0)
        connection = [f"--connect={ports['--bind']}", f"--view-connect={ports['view']}", f"--keys={folder / 'anna'}"]
        connection += [f"--robot-key={public}", "--device=simulated", "--no-console"]
        operator = stack.enter_context(SideProcess("tests.soak.patient_operator", "operator", connection))
        quiet = watch(robot, operator, _SETTLES_S)
        for number, (kind, port, role) in enumerate(ATTACKS):
            if port in ports and kind not in asked.without:
                start("tests.soak.attacks", kind, ports[port], str(folder), f"mallory-{number}" if role else "-")
        attacked = watch(robot, operator, asked.seconds)
        os.kill(robot.process_id, signal.SIGTERM)
        code = robot.wait(60.0)
        figures = json.loads(summary.read_text()) if summary.exists() else {}
        events = Counter(json.loads(line)["event"] for line in (folder / "audit.jsonl").read_text().splitlines())
    return report(quiet, attacked, code, figures, events)


def watch(robot: SideProcess, operator: SideProcess, seconds: float) -> dict[str, Any]:
    """Look at both sides for some seconds; return what was seen."""
    begin_s = time.monotonic()
    first, most, door_most, open_most, late_us = 0, 0, 0, 0, 0.0
    states: Counter[str] = Counter()
    notes: Counter[str] = Counter()
    doors: set[int] = set()
    while (passed_s := time.monotonic() - begin_s) < seconds and robot.running:
        time.sleep(1.0)
        size, door = resident_bytes(robot.process_id), door_of(robot.process_id)
        first, most = first or size, max(most, size)
        door_most, open_most = max(door_most, resident_bytes(door)), max(open_most, descriptors(robot.process_id))
        doors |= {door} - {0}
        for event in operator.events():
            if event["event"] == "status":
                states[str(event.get("state"))] += 1
        for event in robot.events():
            if event["event"] == "status":
                late_us = max(late_us, float(event.get("late_us") or 0.0))
            elif event["event"] == "note":
                notes[str(event.get("text"))[:90]] += 1
        sys.stderr.write(f"\r{passed_s:5.0f} s, {states.get('armed', 0) / max(sum(states.values()), 1):.0%} armed ")
    sys.stderr.write("\n")
    return {
        **{"first": first, "most": most, "door_most": door_most, "open": open_most, "late_ms": 1e-3 * late_us},
        **{"states": states, "doors": len(doors), "notes": notes, "running": robot.running},
    }


def report(
    quiet: dict[str, Any], attacked: dict[str, Any], code: int, figures: dict[str, Any], events: Counter[str]
) -> int:
    """Print what was asked and measured; return 1 if something asked was not held."""
    shares = [one["states"].get("armed", 0) / max(sum(one["states"].values()), 1) for one in (quiet, attacked)]
    armed = f"{shares[1]:.1%}, before {shares[0]:.1%}"
    growth = attacked["most"] - quiet["most"]
    rows = (
        ("the robot process runs to the end, code 0", attacked["running"] and code == 0, f"code {code}"),
        ("its memory grows by less than 20 MB", growth < GROWTH_BYTES, f"{1e-6 * growth:.1f} MB"),
        (
            "the operator is armed 95 % of the time",
            shares[1] >= ARMED_SHARE,
            armed,
        ),
        ("the summary is written", bool(figures), "yes" if figures else "no"),
    )
    for text, held, measured in rows:
        sys.stdout.write(f"{'held    ' if held else 'NOT HELD'}  {text:45} {measured}\n")
    said = (
        f"doors started again: {figures.get('door', {}).get('restarts')}; door at most "
        f"{1e-6 * attacked['door_most']:.0f} MB; descriptors of the robot process at most {attacked['open']}; "
        f"latest turn {attacked['late_ms']:.0f} ms (before: {quiet['late_ms']:.0f})",
        f"strangers: {figures.get('strangers')}",
        f"states: {dict(attacked['states'])}; stops: {Counter(stop['reason'] for stop in figures.get('stops', []))}",
        f"audit log: {dict(events)}",
        *(f"{count:5d}  {text}" for text, count in attacked["notes"].most_common(12)),
    )
    sys.stdout.write("\n".join(said) + "\n")
    return 0 if all(held for _, held, _ in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
