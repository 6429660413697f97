"""The system's own commands, as ip, tc and nft."""

import subprocess
from collections.abc import Sequence
from typing import Final

from common.errors import FeelaheadError

_LIMIT_S: Final = 10.0


class CommandFailedError(FeelaheadError):
    """A command of the system's ended with an error; the text is what it said."""


def run_system(words: Sequence[str], given: str | None = None) -> str:
    """What it prints; `given`: what it reads. CommandFailedError when it fails."""
    try:
        done = subprocess.run(words, input=given, capture_output=True, text=True, timeout=_LIMIT_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CommandFailedError(f"{words[0]}: {error}") from error
    if done.returncode != 0:
        said = done.stderr.strip().splitlines()
        raise CommandFailedError(f"{' '.join(words)}: {said[0] if said else f'code {done.returncode}'}")
    return done.stdout
