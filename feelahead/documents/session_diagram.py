"""The session's table as a diagram and a table in docs/session.md.

python -m feelahead.documents.session_diagram            print what belongs there
python -m feelahead.documents.session_diagram --write    put it there
"""

import sys
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from pathlib import Path

from common.command.command_line import run_command
from common.errors import ConfigurationError
from common.protocol.session import OWNING, TRANSITIONS, SessionState, Transition
from feelahead.documents.generated_part import with_generated_part

PROGRAM = "python -m feelahead.documents.session_diagram"
DOCUMENT = Path(__file__).parents[2] / "docs" / "session.md"
_OWNER = "owner"


def diagram(transitions: Sequence[Transition] = TRANSITIONS) -> str:
    """A mermaid stateDiagram of every transition that leads to another state; rows alike share an arrow.

    The states of the lease's owner stand in a box: every way in begins disarmed, and a way out is drawn once when
    it leads from all of them.
    """
    arrows: dict[tuple[str, str], list[str]] = {}
    for row in transitions:
        if row.after is not row.before:
            for arrow in _arrows(row, transitions):
                events = arrows.setdefault(arrow, [])
                if row.event.value not in events:
                    events.append(row.event.value)
    inner = {state.value for state in OWNING}
    lines = ["stateDiagram-v2", f"    [*] --> {SessionState.UNKNOWN.value}", f"    state {_OWNER} {{"]
    lines += [f"        [*] --> {SessionState.DISARMED.value}"]
    lines += [f"    {line}" for line in _lines(arrows, inner)]
    lines += ["    }", *_lines(arrows, None, inner), f"    {SessionState.ENDED.value} --> [*]"]
    return "\n".join(lines)


def _arrows(row: Transition, transitions: Sequence[Transition]) -> list[tuple[str, str]]:
    """Between which two names this row is drawn."""
    if row.before not in OWNING and row.after in OWNING:
        if row.after is not SessionState.DISARMED:
            raise ValueError(f"{row.before.value} leads to {row.after.value}; valid: a lease begins disarmed")
        return [(row.before.value, _OWNER)]
    alike = {other.before for other in transitions if (other.event, other.after) == (row.event, row.after)}
    if row.before in OWNING and row.after not in OWNING and alike >= OWNING:
        return [(_OWNER, row.after.value)]
    return [(row.before.value, row.after.value)]


def _lines(
    arrows: dict[tuple[str, str], list[str]], within: AbstractSet[str] | None, without: AbstractSet[str] = frozenset()
) -> list[str]:
    """The arrows that stay `within` these names; with None, those that do not stay within `without`."""
    return [
        f"    {before} --> {after}: {' / '.join(events)}"
        for (before, after), events in arrows.items()
        if ({before, after} <= within if within is not None else not {before, after} <= without)
    ]


def table(transitions: Sequence[Transition] = TRANSITIONS) -> str:
    """Every row as Markdown, those that only count included."""
    return "\n".join(["| state | event | next state | why |", "|---|---|---|---|", *_rows(transitions)])


def _rows(transitions: Sequence[Transition]) -> Iterator[str]:
    for row in transitions:
        after = "stays" if row.after is row.before else row.after.value
        yield f"| {row.before.value} | {row.event.value} | {after} | {row.why} |"


def generated() -> str:
    """What stands between the two marks of docs/session.md."""
    return f"```mermaid\n{diagram()}\n```\n\n{table()}"


def command(arguments: Sequence[str]) -> int:
    """Print the generated part, or with --write put it into the document."""
    if list(arguments) == ["--write"]:
        document = with_generated_part(DOCUMENT.read_text(encoding="utf-8"), generated())
        DOCUMENT.write_text(document, encoding="utf-8")
        return 0
    if list(arguments) in (["-h"], ["--help"]):
        sys.stdout.write(f"usage: {PROGRAM} [--write]\n\n{__doc__}")
        return 0
    if arguments:
        raise ConfigurationError(f"unknown flag {arguments[0]!r}; valid: --write, or nothing to print")
    sys.stdout.write(generated() + "\n")
    return 0


if __name__ == "__main__":
    run_command(PROGRAM, command)
