"""Messages that a robot side sends, and their streams."""

from typing import Final, Literal, NamedTuple, get_args

OutgoingStream = Literal["haptics", "telemetry", "video", "scene"]
SENT_STREAMS: Final[tuple[OutgoingStream, ...]] = get_args(OutgoingStream)
SHOWN_NAME: Final = 100
"""Number of characters to which an object's name is cut before it is sent or shown, as messages have a limited size"""


class Outgoing(NamedTuple):
    """Payload to send: of haptics to `peer` at the control port, of other streams to all viewers."""

    stream: OutgoingStream
    peer: bytes
    payload: bytes
    everywhere: bool = False
    """Whether to send over every connection of `peer`, because the message must arrive soon; else over the next one in
    turn"""
