"""`feelahead bench NAME`: the benchmarks, each of which prints its goals as met or missed."""

import sys
from collections.abc import Sequence

from common.errors import ConfigurationError

_BENCHMARKS = {
    "overlap": "run time against error of the exact overlaps and of what is used in their place",
}
"""Each name with what it measures; its module is imported only when it is asked for."""


def bench(arguments: Sequence[str]) -> int:
    """Run the benchmark that the first argument names."""
    if not arguments or arguments[0] in ("-h", "--help"):
        lines = [f"  {name:<12}{text}" for name, text in _BENCHMARKS.items()]
        sys.stdout.write(
            "usage: feelahead bench NAME [OPTIONS]\n\n" + "\n".join(lines) + "\n\nEach has its own --help.\n"
        )
        return 0
    name, *rest = arguments
    if name not in _BENCHMARKS:
        raise ConfigurationError(f"bench {name!r}: no such benchmark; valid: {', '.join(_BENCHMARKS)}")
    try:
        from feelahead.benchmarks.overlap_bench import bench_overlap  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            f"bench {name}: {error.name} is not installed; pip install 'feelahead[robot,bench]'"
        ) from error
    return bench_overlap(rest)
