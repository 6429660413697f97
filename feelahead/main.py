"""Command `feelahead`: its subcommands, and the text of its help."""

import sys
from collections.abc import Callable, Sequence

from common.errors import ConfigurationError
from feelahead.commands.bench_and_try import bench, try_out
from feelahead.commands.calibrate import calibrate
from feelahead.commands.demo.command import demo
from feelahead.commands.doctor.command import doctor
from feelahead.commands.feel.command import feel
from feelahead.commands.keys import keys
from feelahead.commands.recordings import export, plot, replay
from feelahead.commands.virtual_dualsense import virtual_dualsense

_COMMANDS: dict[str, tuple[Callable[[Sequence[str]], int], str]] = {
    "demo": (demo, "both sides on this machine, with a simulated controller and person"),
    "doctor": (doctor, "find what is missing on this machine, or wrong on the path to a robot side, with the remedy"),
    "calibrate": (calibrate, "measure where a controller's triggers and sticks begin and end"),
    "feel": (feel, "feel the triggers' zones with a controller alone, or measure their forces with a kitchen scale"),
    "keys": (keys, "who may operate the robot side: make key pairs, allow, list and revoke"),
    "virtual-dualsense": (virtual_dualsense, "a controller that every program on this machine sees, with no hardware"),
    "replay": (replay, "show a recording, or compute it again and compare"),
    "export": (export, "turn a recording into CSV, Parquet or a LeRobot dataset"),
    "plot": (plot, "draw a recording on one page"),
    "bench": (bench, "measure speed and accuracy, compared with alternatives"),
    "try": (try_out, "run an experiment in simulation: approaches, the demo, haptics on and off, latency"),
}


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
    if name not in _COMMANDS:
        raise ConfigurationError(f"unknown command {name!r}; valid: {', '.join(_COMMANDS)}")
    return _COMMANDS[name][0](rest)
