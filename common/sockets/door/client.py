"""Our end of the door, in the process that ticks. Without ZeroMQ: nothing that strangers send is parsed here."""

import select
import signal
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, Self, cast

import msgspec

from common.clock import Clock, MonotonicClock
from common.companion.process import Companion
from common.errors import ConfigurationError
from common.sockets.door.messages import (
    ROOM_BYTES,
    Asked,
    Close,
    DoorSettings,
    DriverSettings,
    Event,
    Failed,
    Figures,
    FromDriver,
    FromPeer,
    Listen,
    Listening,
    Owner,
    Ready,
    Take,
    ToDriver,
    ToPeer,
    ToViewers,
    decode_said,
    encode,
)
from common.sockets.endpoints import parse_driver, parse_operators
from common.sockets.keys import KeyFolder
from common.sockets.tcp_figures import TcpFigures

MODULE: Final = "common.sockets.door.keeper"
RETRY_S: Final = 0.5
_LIVED_S: Final = 5.0
"""Time until the next start, in seconds, after a door that ended within `_LIVED_S`; others are replaced at once."""
SILENT_S: Final = 3.0
"""Time without a word, in seconds, after which a door is taken to hang: it says something ten times a second"""
_STARTS_S: Final = 60.0
"""Time, in seconds, after which one that starts is taken to hang: slow machines start slowly"""
_OURS_S: Final = 0.5
"""Time between two of our own calls from which on the silence may be ours"""
_LAST_WORDS_S: Final = 0.5
_END_S: Final = 1.0
"""Times for which the end waits for the last figures, and then for the process; the rest of 2 s is for the system."""
_WAITING: Final = 4096
"""Messages that wait to be taken at most; beyond, the oldest is dropped"""


class DriverPort:
    """Port of one kind of program of the user, behind the door."""

    def __init__(self, door: "Door", flag: str) -> None:
        self._door, self._flag = door, flag
        self.arrived: deque[tuple[bytes, bytes, float]] = deque(maxlen=_WAITING)

    @property
    def endpoint(self) -> str:
        """Bound address, with the port that the system chose."""
        return self._door.drivers[self._flag].bind

    def receive(self) -> list[tuple[bytes, bytes, float]]:
        """Return (peer, payload, time of arrival) of the messages that have arrived, oldest first; never waits."""
        self._door.update()
        arrived = list(self.arrived)
        self.arrived.clear()
        return arrived

    def send(self, peer: bytes, payload: bytes) -> bool:
        """Pass a message on to the door; return False, and count it in `dropped`, if the door takes none now."""
        return self._door.ask(ToDriver(self._flag, peer, payload))

    def ask(self) -> bool:
        """Ask a port that passes on request for its newest messages; return False if the door takes nothing now."""
        return self._door.ask(Take(self._flag))

    def wait(self, timeout_s: float) -> float:
        """Wait for any message, at most `timeout_s`; return the time on our monotonic clock."""
        self._door.wait(timeout_s)
        return self._door.clock.now()


class Door:
    """Ports of the robot side, in a companion process that is started again whenever it ends.

    Peers keep their names over a new start, so that sessions go on as soon as operators have connected again.
    """

    def __init__(
        self,
        settings: DoorSettings,
        note: Callable[[str], None],
        clock: Clock | None = None,
        start: Callable[[str], Companion] = lambda text: Companion(MODULE, [text], ROOM_BYTES),
    ) -> None:
        """Check the settings; ConfigurationError for a wrong one. `ready` starts the companion.

        note: called with lines that people read. start: starts the companion with settings as JSON.
        """
        guarded = settings.insecure or settings.keys is not None
        parse_operators(settings.bind, settings.view_bind, guarded=guarded)
        for flag, driver in settings.drivers.items():
            parse_driver(driver.bind, flag, guarded=guarded)
        if settings.keys is not None:
            KeyFolder(Path(settings.keys)).secret("robot")
        self.dropped = 0
        """Number of our messages that the door did not take"""
        self.restarts = 0
        self.clock = clock or MonotonicClock()
        self._settings, self._note, self._start = settings, note, start
        self._events: deque[Event] = deque(maxlen=_WAITING)
        self.ports = {flag: DriverPort(self, flag) for flag in settings.drivers}
        self._arrived: deque[tuple[bytes, bytes]] = deque(maxlen=_WAITING)
        self._figures = Figures({}, TcpFigures(), [], [], "")
        self._before: dict[str, int] = {}
        """Counts of doors that have ended"""
        self._owner: bytes | None = None
        self._listening: Listening | None = None
        self._ready, self._closed = False, False
        self._failure: str | None = None
        self._next_start_s: float | None = None
        self._heard_s = self._called_s = self._began_s = self.clock.now()
        self._companion: Companion | None = None

    @property
    def drivers(self) -> dict[str, DriverSettings]:
        """Settings of the programs' ports; their addresses are the bound ones once the door is ready."""
        return self._settings.drivers

    def counts(self) -> dict[str, int]:
        """Return the counts of `keeper.py`, over all doors of this run."""
        new = self._figures.counts
        return {name: new.get(name, 0) + self._before.get(name, 0) for name in {**self._before, **new}}

    def ready(self) -> None:
        """Start the companion and bind the programs' ports; ConfigurationError if one cannot be bound, or is in use."""
        self._begin(self.clock.now())
        self._await(lambda: self._ready)

    def listen(self) -> Listening:
        """Bind the ports of operators; return their addresses. ConfigurationError if one cannot be bound."""
        self._settings = msgspec.structs.replace(self._settings, listens=True)
        self.ask(Listen())
        self._await(lambda: self._listening is not None)
        return cast(Listening, self._listening)

    def receive(self) -> Sequence[tuple[bytes, bytes]]:
        """Return (peer, payload) of the control messages that have arrived, oldest first; never waits."""
        self.update()
        arrived = list(self._arrived)
        self._arrived.clear()
        return arrived

    def send(self, peer: bytes, payload: bytes, *, everywhere: bool = False) -> bool:
        """Send to `peer`; everywhere: over each of its connections. Return whether the door took the message."""
        return self.ask(ToPeer(peer, payload, everywhere))

    def publish(self, topic: bytes, payload: bytes) -> None:
        """Send to all subscribers of `topic`."""
        self.ask(ToViewers(topic, payload))

    def own(self, peer: bytes | None) -> None:
        """Say which peer owns the lease."""
        if peer != self._owner:
            self._owner = peer
            self.ask(Owner(peer))

    def take_events(self) -> list[Event]:
        """Return what happened at the ports since the last call, oldest first."""
        events = list(self._events)
        self._events.clear()
        return events

    def tcp_figures(self, peer: bytes) -> TcpFigures:
        """Return the kernel's TCP figures of all connections to the owner; those of no packet for another peer."""
        return self._figures.tcp if peer == self._owner else TcpFigures()

    def wait(self, timeout_s: float | None) -> bool:
        """Wait for a message, at most `timeout_s` (None: no limit); return whether there is one. May return early."""
        if self._waiting():
            return True
        channel = None if self._companion is None else self._companion.channel
        if channel is None or channel.ended:
            select.select([], [], [], min(RETRY_S, RETRY_S if timeout_s is None else timeout_s))
        else:
            select.select([channel], [channel] if channel.waiting else [], [], timeout_s)
        self.update()
        return self._waiting()

    def update(self) -> None:
        """Take what the door has said, and start it again if it has ended or hangs."""
        if self._companion is None:
            return
        now_s, channel = self.clock.now(), self._companion.channel
        for payload in channel.receive():
            self._heard_s = now_s
            self._take(payload)
        if now_s - self._called_s > _OURS_S:
            self._heard_s = now_s
        self._called_s = now_s
        if self._closed or self._failure is not None:
            return
        if self._next_start_s is not None:
            if now_s >= self._next_start_s:
                self._begin(now_s)
        elif channel.ended or now_s - self._heard_s > (SILENT_S if self._ready else _STARTS_S):
            self._end(self._companion, now_s)

    def ask(self, message: Asked) -> bool:
        """Send a message to the door; return False, and count it in `dropped`, if it takes none now."""
        taken = self._companion is not None and self._companion.channel.send(encode(message))
        self.dropped += not taken
        return taken

    def close(self) -> None:
        """Take the last figures and end the door, within 2 s; a second call does no harm."""
        if self._closed or self._companion is None:
            return
        self._closed, end_s, channel = True, self.clock.now() + _LAST_WORDS_S, self._companion.channel
        self.ask(Close())
        while not channel.ended and (left_s := end_s - self.clock.now()) > 0.0:
            select.select([channel], [], [], left_s)
            self.update()
        self.update()
        self._companion.close(_END_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _waiting(self) -> bool:
        return bool(self._arrived) or any(port.arrived for port in self.ports.values())

    def _await(self, condition: Callable[[], bool]) -> None:
        while not condition():
            self.wait(SILENT_S)
            # While a program's message waits, `wait` takes nothing from the door.
            self.update()
            if self._failure is not None:
                raise ConfigurationError(self._failure)

    def _take(self, payload: bytes) -> None:
        said = decode_said(payload)
        match said:
            case FromPeer(peer, control):
                self._arrived.append((peer, control))
            case FromDriver(flag, peer, message, received_s):
                self.ports[flag].arrived.append((peer, message, received_s))
            case Figures():
                self._figures = said
                for text in said.notes:
                    self._note(text)
                self._events.extend(said.events)
            case Ready(drivers, notes):
                self._ready = True
                bound = {
                    flag: msgspec.structs.replace(one, bind=drivers[flag])
                    for flag, one in self._settings.drivers.items()
                }
                self._settings = msgspec.structs.replace(self._settings, drivers=bound)
                for text in notes if not self.restarts else ():
                    self._note(text)
            case Listening(control, view):
                self._listening = said
                self._settings = msgspec.structs.replace(self._settings, bind=control, view_bind=view)
            case Failed(text):
                # Once it has listened, the port is ours: whatever is in the way now is tried again.
                if self._listening is None:
                    self._failure = text

    def _text(self) -> str:
        return msgspec.json.encode(self._settings).decode()

    def _begin(self, now_s: float) -> None:
        self._next_start_s, self._heard_s, self._began_s, self._ready = None, now_s, now_s, False
        self._companion = self._start(self._text())
        self.ask(Owner(self._owner))

    def _end(self, companion: Companion, now_s: float) -> None:
        """Note why the door ended, and who had sent most; start another one soon."""
        ended = companion.channel.ended
        companion.close(0.0)
        if not (self._ready or self.restarts):
            self._failure = "the process that owns the ports ended while it started"
            return
        self._next_start_s = now_s + (RETRY_S if now_s - self._began_s < _LIVED_S else 0.0)
        if not self._ready:
            return
        self.restarts += 1
        code = companion.code
        how = f"ended ({signal.Signals(-code).name if code < 0 else f'code {code}'})" if ended else "hung and was ended"
        busiest = self._figures.busiest
        who = f"; most came from {busiest}" if busiest else ""
        self._note(f"the process that owns the ports {how}; another one is started, and peers connect again{who}")
        self._before = self.counts()
        self._figures = Figures({}, TcpFigures(), [], [], "")
