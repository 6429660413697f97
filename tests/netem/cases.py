"""Links that are measured in the virtual machine, and compared with our emulation outside."""

from dataclasses import dataclass

from common.emulation.clauses import LinkModel


@dataclass(frozen=True, slots=True)
class Case:
    """One link, in netem's words, and the kind of messages sent through it."""

    name: str
    netem: str
    model: LinkModel = "datagram"
    messages: int = 6000
    judged: bool = True
    """Whether a difference fails the test; False: it is only printed, as our model is known to differ"""

    @property
    def file(self) -> str:
        """Name of the file with this case's recording."""
        return f"{self.name}.csv"


_NORMAL = "delay 20ms 5ms distribution normal"

PATH_CASE = Case("path", "delay 20ms", messages=2000)
"""Case for the delay that the path has besides netem's"""
CASES = (
    Case("normal", _NORMAL),
    Case("uniform", "delay 20ms 5ms"),
    Case("pareto", "delay 20ms 5ms distribution pareto"),
    Case("rate", f"{_NORMAL} rate 10mbit"),
    Case("loss", "loss 1%"),
    Case("gemodel", "loss gemodel 1% 25%", messages=10_000),
    Case("stream-fixed", "delay 20ms", "stream"),
    Case("stream-normal", _NORMAL, "stream"),
    Case("stream-loss", "delay 20ms loss 1%", "stream", messages=10_000, judged=False),
)
PAYLOAD_BYTES = 100
PERIOD_NS = 1_000_000
