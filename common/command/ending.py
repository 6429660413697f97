"""End a side's process: every run writes its summary, one that failed, too."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from common.command.stop_signal import ignore_broken_output
from common.files.output_file import write_json


def failure_of(run: Callable[[], None]) -> Exception | None:
    """Run, and return what went wrong. A broken pipe is no failure: the reader of our output has left."""
    try:
        run()
    except BrokenPipeError:
        ignore_broken_output()
    except Exception as error:
        return error
    return None


def end_with(summary: Mapping[str, Any], path: Path | None, failure: Exception | None = None) -> None:
    """Write the summary to `path`, with the run's failure in `errors`, and raise that."""
    try:
        if path is not None:
            write_json("--summary", path, {**summary, "errors": [] if failure is None else [str(failure)]})
    finally:
        if failure is not None:
            raise failure
