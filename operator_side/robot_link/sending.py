"""Sends messages through the emulated link to the sockets, and measures their queueing delay."""

from collections.abc import Iterable
from typing import Any

from common.emulation.delay_line import DelayLine, link_summary
from common.emulation.spec import LinkSpec
from common.emulation.tuned import tuned_link
from common.rate.budget import Budget
from common.rate.outgoing_queue import OutgoingQueue
from common.sockets.operator import OperatorSockets
from operator_side.robot_link.commanding import ToRobot


class Sending:
    """Sender of messages to the robot side, without rate control: there are only small, urgent messages."""

    def __init__(self, link: LinkSpec, sockets: OperatorSockets) -> None:
        self._link = link
        self._sockets = sockets
        self.line: DelayLine[ToRobot] = DelayLine(
            link.profile("to_robot"), corrupt=lambda message, flip: message._replace(payload=flip(message.payload))
        )
        self._budget: Budget[str] = Budget()

    def push(self, messages: Iterable[ToRobot], now_s: float) -> None:
        """Put messages of the core and of the console into the emulated link."""
        for message in messages:
            self._budget.spend("haptics", len(message.payload), now_s)
            self.line.push(now_s, message, len(message.payload))

    def measure(self, queue: OutgoingQueue, now_s: float) -> None:
        """Update the queueing delay. queue: measurement of the queue that our messages wait in, from echoes."""
        self._budget.hear(queue, now_s)
        self._budget.take(now_s)

    def send(self, now_s: float) -> bool:
        """Send the messages that leave the emulated link now; return False if any was taken by no connection."""
        taken = [self._sockets.send(one.payload, everywhere=one.everywhere) for one in self.line.pop(now_s)]
        return all(taken)

    def tune(self, words: str) -> None:
        """Emulate the link `words`, in netem's words, from now on."""
        self._link = tuned_link(self._link, words)
        self.line.change(self._link.profile("to_robot"))

    @property
    def video_later_s(self) -> float:
        """Delay that the emulated link gives pictures on top of the control stream's, in seconds."""
        video, control = (self._link.profile("to_operator", stream).mean_delay_s() for stream in ("video", "haptics"))
        return max(0.0, video - control)

    @property
    def queue_ms(self) -> float:
        """Present queueing delay of our messages, in milliseconds."""
        return self._budget.status()["queue_ms"]

    def summary(self) -> dict[str, Any]:
        """Return the run's figures: `link`, the emulated link, and `rate`, sending rate and queueing delay."""
        link = link_summary("to_robot", {"haptics": self.line})
        return {"link": link, "rate": {"operator": self._budget.summary()}}
