"""The command `make wide-area`, also `python -m tests.two_hosts.wide_area`.

It runs both sides (question.py); with the first argument `stream`, it sends messages only (stream.py).
"""

from collections.abc import Sequence

from common.command.command_line import run_command
from feelahead.lab.sweep import ask
from tests.two_hosts.wide_area import question, stream


def command(arguments: Sequence[str]) -> int:
    """Run the question that the first argument selects; return the exit code."""
    return ask(stream.QUESTION, arguments[1:]) if arguments[:1] == ["stream"] else ask(question.QUESTION, arguments)


run_command("wide-area", command)
