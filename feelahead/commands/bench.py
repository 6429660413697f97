"""`feelahead bench NAME`: the benchmarks, each of which prints its goals as met or missed."""

import sys
from collections.abc import Callable, Sequence

from common.errors import ConfigurationError


def _overlap(arguments: Sequence[str]) -> int:
    from feelahead.benchmarks.overlap.bench import bench_overlap  # noqa: PLC0415

    return bench_overlap(arguments)


def _link(arguments: Sequence[str]) -> int:
    from feelahead.benchmarks.link.bench import bench_link  # noqa: PLC0415

    return bench_link(arguments)


def _dualsense(arguments: Sequence[str]) -> int:
    from feelahead.benchmarks.dualsense.bench import bench_dualsense  # noqa: PLC0415

    return bench_dualsense(arguments)


def _effects(arguments: Sequence[str]) -> int:
    from feelahead.benchmarks.effects.effect_latency import bench_effects  # noqa: PLC0415

    return bench_effects(arguments)


_BENCHMARKS: dict[str, tuple[Callable[[Sequence[str]], int], str, str]] = {
    "overlap": (
        _overlap,
        "run time against error of the exact overlaps and of what is used in their place",
        "pip install 'feelahead[robot,bench]'",
    ),
    "link": (
        _link,
        "the emulated link beside what was asked, and beside recordings of the kernel's netem",
        "pip install feelahead",
    ),
    "dualsense": (
        _dualsense,
        "our driver of the controller beside pydualsense, on the same simulated reports",
        "pip install 'feelahead[operator,bench]'",
    ),
    "effects": (
        _effects,
        "how long it takes from a change of stiffness until the controller is told",
        "pip install feelahead",
    ),
}
"""Each name with what it runs, what that measures, and what brings it; imported only when it is asked for."""


def bench(arguments: Sequence[str]) -> int:
    """Run the benchmark that the first argument names."""
    if not arguments or arguments[0] in ("-h", "--help"):
        lines = [f"  {name:<12}{text}" for name, (_, text, _) in _BENCHMARKS.items()]
        sys.stdout.write(
            "usage: feelahead bench NAME [OPTIONS]\n\n" + "\n".join(lines) + "\n\nEach has its own --help.\n"
        )
        return 0
    name, *rest = arguments
    if name not in _BENCHMARKS:
        raise ConfigurationError(f"bench {name!r}: no such benchmark; valid: {', '.join(_BENCHMARKS)}")
    run, _, remedy = _BENCHMARKS[name]
    try:
        return run(rest)
    except ModuleNotFoundError as error:
        raise ConfigurationError(f"bench {name}: {error.name} is not installed; {remedy}") from error
