"""What the side that runs tells the process that draws."""

import msgspec

from operator_side.facts import OperatorFacts


class NewFacts(msgspec.Struct, frozen=True, tag="facts"):
    """The newest moment."""

    facts: OperatorFacts


class Note(msgspec.Struct, frozen=True, tag="note"):
    """A line for people."""

    text: str


Said = NewFacts | Note
