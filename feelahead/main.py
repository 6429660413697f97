"""Command `feelahead`: its subcommands, and the text of its help."""

import sys
from collections.abc import Callable, Sequence
from importlib import import_module

from common.errors import ConfigurationError

_COMMANDS: dict[str, tuple[str, str]] = {
    "demo": ("demo.command:demo", "both sides on this machine, with a simulated controller and person"),
    "doctor": (
        "doctor.command:doctor",
        "find what is missing on this machine, or wrong on the path to a robot side, with the remedy",
    ),
    "controller": (
        "controller.command:controller",
        "a controller alone: feel its zones, calibrate it, measure its forces",
    ),
    "keys": ("keys:keys", "who may operate the robot side: make key pairs, allow, list and revoke"),
    "virtual-dualsense": (
        "virtual_dualsense:virtual_dualsense",
        "a controller that every program on this machine sees, with no hardware",
    ),
    "replay": ("recordings:replay", "show a recording, or compute it again and compare"),
    "export": ("recordings:export", "turn a recording into CSV, Parquet or a LeRobot dataset"),
    "plot": ("recordings:plot", "draw a recording on one page"),
    "study": (
        "study.command:study",
        "a study with people, from a protocol to a report; also with simulated people",
    ),
    "bench": ("bench_and_try:bench", "measure speed and accuracy, compared with alternatives"),
    "try": (
        "bench_and_try:try_out",
        "run an experiment in simulation: approaches, the demo, haptics on and off, latency",
    ),
}
"""By its name: where each command is, as a module of feelahead.commands and a function, and its help"""
_MOVED = {
    "calibrate": "feelahead controller --calibrate",
    "feel": "feelahead controller (with --measure-forces for --measure)",
}
"""Former commands, and what does the same now"""


def command(arguments: Sequence[str]) -> int:
    """Run the subcommand that the first argument names; without one, print the help."""
    if not arguments or arguments[0] in ("-h", "--help"):
        lines = [f"  {name:<19}{text}" for name, (_, text) in _COMMANDS.items()]
        sys.stdout.write(
            "usage: feelahead COMMAND [OPTIONS]\n\nTeleoperation in which the operator feels what is ahead.\n\n"
            + "\n".join(lines)
            + "\n\nEach has its own --help. The two sides by themselves: feelahead-robot, feelahead-operator.\n"
        )
        return 0
    name, *rest = arguments
    if name in _MOVED:
        raise ConfigurationError(f"{name} is part of another command now: {_MOVED[name]}")
    if name not in _COMMANDS:
        raise ConfigurationError(f"unknown command {name!r}; valid: {', '.join(_COMMANDS)}")
    module, _, function = _COMMANDS[name][0].partition(":")
    # Only this command: the others take longer to import than the demo takes to show its address.
    run: Callable[[Sequence[str]], int] = getattr(import_module(f"feelahead.commands.{module}"), function)
    return run(rest)
