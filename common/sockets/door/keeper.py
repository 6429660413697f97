"""Companion process of the door: it owns the ports, admits and cuts off peers, and passes messages on.

If it comes to the limit of its memory, or ZeroMQ aborts it, only this process ends; the door starts another one.
"""

import resource
import select
import sys
from collections.abc import Sequence
from contextlib import ExitStack, closing, nullcontext
from pathlib import Path
from typing import Final, cast

import msgspec

from common.clock import MonotonicClock
from common.companion.channel import Channel
from common.companion.process import companion_channel
from common.errors import ConfigurationError
from common.realtime.priority import raise_descriptor_limit, raise_priority
from common.sockets.authentication import RobotKeys
from common.sockets.door.admission import Admission
from common.sockets.door.held import Held
from common.sockets.door.messages import (
    ROOM_BYTES,
    Asked,
    Close,
    DoorSettings,
    Event,
    Failed,
    Figures,
    FromDriver,
    FromPeer,
    Kind,
    Listen,
    Listening,
    Owner,
    Ready,
    Said,
    Take,
    ToDriver,
    ToPeer,
    ToViewers,
    decode_asked,
    encode,
)
from common.sockets.driver_port import DriverPort, Received
from common.sockets.robot import RobotSockets
from common.sockets.tcp_figures import TcpFigures

MEMORY_BYTES: Final = 512 << 20
"""Limit of the process's data, in bytes. A usual run takes a tenth."""
_WATCH_S: Final = 0.1
KEYS_S: Final = 0.2
"""Periods of the figures and budgets, and of reading the list of allowed keys: a revoked operator is cut off in 1 s"""
_WINDOW_S: Final = 2.0
"""Period in which a key may make so many handshakes (MOST_HANDSHAKES), in seconds"""
_BARRED_S: Final = 10.0
"""Time for which a key that flooded is not let in, in seconds"""
_WAIT_S: Final = 0.05
_MOST_EVENTS: Final = 3
"""Largest number of events of a kind, each tenth of a second: strangers without keys make as many names as they like"""


class Keeper:
    """Ports, and what passes between them and the channel."""

    def __init__(self, settings: DoorSettings, channel: Channel, opened: ExitStack) -> None:
        """Bind the programs' ports, and the operators' if the settings say so. Raises ConfigurationError."""
        self._settings, self._channel, self._opened = settings, channel, opened
        self._clock, self._admission = MonotonicClock(), Admission()
        self._keys = None if settings.keys is None else RobotKeys.load(Path(settings.keys))
        self._owner: bytes | None = None
        self._sockets: RobotSockets | None = None
        self._unpassed = 0
        self._barred: dict[str, float] = {}
        self._busiest = ""
        self._present: dict[tuple[str, bytes], tuple[str, str]] = {}
        self._heavy = 0
        self._watch_s = self._keys_s = self._window_s = self._clock.now()
        self._ends = False
        # Fail at once for an occupied port; open meanwhile, so that a program's flag with the same port is named.
        with nullcontext() if settings.listens else closing(self._bound()):
            self._drivers = {
                flag: opened.enter_context(
                    DriverPort(
                        *(one.bind, flag, one.limit_bytes),
                        insecure=settings.insecure,
                        keys=self._keys,
                        role=one.role,
                        bytes_per_s=one.bytes_per_s,
                    )
                )
                for flag, one in settings.drivers.items()
            }
        self._held = {flag: Held() for flag, one in settings.drivers.items() if one.on_request}
        notes = [] if self._keys is None else self._keys.notes()
        self._say(Ready({flag: port.endpoint for flag, port in self._drivers.items()}, notes))
        if settings.listens:
            self._listen()

    def run(self) -> None:
        """Pass messages on until the channel ends, or the other end asks for it."""
        channel, admission = self._channel, self._admission
        while not (channel.ended or self._ends):
            self._wait()
            now_s = self._clock.now()
            if self._sockets is not None:
                for peer, payload in admission.admitted(self._sockets.receive(), self._owner, now_s):
                    self._say(FromPeer(peer, payload))
            for flag, port in self._drivers.items():
                received = port.receive()
                self._pass_on(flag, self._held[flag].add(received) if flag in self._held else received)
            for payload in channel.receive():
                self._do(decode_asked(payload))
            if now_s >= self._watch_s:
                self._watch_s = now_s + _WATCH_S
                self._watch(now_s)

    def _pass_on(self, flag: str, received: Sequence[Received]) -> None:
        for message in received:
            self._say(FromDriver(flag, *message))

    def _bound(self) -> RobotSockets:
        settings = self._settings
        return RobotSockets(settings.bind, settings.view_bind, insecure=settings.insecure, keys=self._keys)

    def _listen(self) -> None:
        self._sockets = self._opened.enter_context(self._bound())
        self._say(Listening(self._sockets.control_endpoint, self._sockets.view_endpoint))

    def _say(self, said: Said) -> None:
        self._unpassed += not self._channel.send(encode(said))

    def _wait(self) -> None:
        ports = [*self._drivers.values()] if self._sockets is None else [self._sockets, *self._drivers.values()]
        waits_s = _WAIT_S
        polled = select.poll()
        polled.register(self._channel.fileno(), select.POLLIN | (select.POLLOUT if self._channel.waiting else 0))
        for port in ports:
            if port.pending():
                waits_s = 0.0
            for descriptor in port.descriptors:
                polled.register(descriptor, select.POLLIN)
        polled.poll(1e3 * waits_s)

    def _do(self, asked: Asked) -> None:
        match asked:
            case ToDriver(flag, peer, payload):
                self._drivers[flag].send(peer, payload)
            case Take(flag):
                self._pass_on(flag, self._held[flag].ask())
            case Owner(peer):
                self._owner = peer
            case Close():
                self._ends = True
                self._watch(self._clock.now())
                self._channel.flush()
            case Listen():
                if self._sockets is None:
                    self._listen()
            case ToPeer(peer, payload, everywhere) if self._sockets is not None:
                self._sockets.send(peer, payload, everywhere=everywhere)
            case ToViewers(topic, payload) if self._sockets is not None:
                self._sockets.publish(topic, payload)

    def _watch(self, now_s: float) -> None:
        """Read the keys, cut off who sends too much, and say the figures."""
        sockets, notes = self._sockets, []
        flooding: set[str] = set()
        heaviest = (0, "")
        for port in self._drivers.values():
            heaviest = max(heaviest, port.cut_off(now_s))
            flooding |= port.take_flooding()
        if sockets is not None:
            heaviest = max(heaviest, sockets.cut_off(now_s))
            flooding |= sockets.take_flooding()
        if now_s >= self._window_s:
            self._window_s = now_s + _WINDOW_S
            for each in (*self._drivers.values(), *([] if sockets is None else [sockets])):
                flooding |= each.begin_window()
        if now_s >= self._keys_s:
            self._keys_s = now_s + KEYS_S
            # Once for all ports: it tells of each revocation once.
            revoked = set() if self._keys is None else self._keys.allowed.refresh()
            for port in self._drivers.values():
                notes += port.news()
            if sockets is not None:
                sockets.cut_off_keys(revoked)
                notes += sockets.news()
        before = self._barred.keys()
        notes += self._bar(flooding, now_s)
        size, who = heaviest
        events = self._events(sorted(self._barred.keys() - before))
        if (heavy := self._counts()["heavy"]) > self._heavy:
            self._heavy = heavy
            events.append(Event("cut off", "", who))
        if size:
            self._busiest = f"{who}, {1e-3 * size / _WATCH_S:.0f} kB/s"
        self._say(Figures(self._counts(), self._tcp(), notes, events, self._busiest))

    def _events(self, barred: Sequence[str]) -> list[Event]:
        """Return what is new for the audit log. barred: keys that are barred now."""
        names = {} if self._keys is None else self._keys.allowed.names
        ports: dict[str, DriverPort | RobotSockets] = {**self._drivers}
        if self._sockets is not None:
            ports["--bind"] = self._sockets
        before = self._present
        self._present = {(flag, peer): who for flag, port in ports.items() for peer, who in port.present().items()}
        events = [Event("barred", names.get(key, key), "") for key in barred]
        for kind, one, other in (("connected", self._present, before), ("left", before, self._present)):
            new = [(place, who) for place, who in one.items() if place not in other]
            for (flag, peer), (key, address) in new[:_MOST_EVENTS]:
                shown = peer if flag == "--bind" else b""
                events.append(Event(cast(Kind, kind), names.get(key, key), f"{address} at {flag}", shown))
        for flag, port in ports.items():
            refusals = port.take_refusals()
            events += [Event("refused", names.get(key, key), f"{address} at {flag}") for key, address in refusals]
        if self._keys is not None:
            events += [Event("revoked", name, "") for name in self._keys.allowed.revoked]
            self._keys.allowed.revoked.clear()
        return events

    def _bar(self, flooding: set[str], now_s: float) -> list[str]:
        """Let no key in for a while that flooded; return a line for each."""
        keys = self._keys
        if keys is None:
            return []
        self._barred = {key: until_s for key, until_s in self._barred.items() if until_s > now_s}
        new = {key for key in flooding if key in keys.allowed.names and key not in self._barred}
        self._barred |= dict.fromkeys(new, now_s + _BARRED_S)
        keys.allowed.barred = frozenset(self._barred)
        names = sorted(keys.allowed.names[key] for key in new)
        return [f"{name} sent too much, and is not let in for {_BARRED_S:g} s" for name in names]

    def _counts(self) -> dict[str, int]:
        ports: list[DriverPort | RobotSockets] = [*self._drivers.values()]
        if self._sockets is not None:
            ports.append(self._sockets)
        return {
            "unread": self._admission.unread,
            "unpassed": self._unpassed,
            "refused": sum(port.refused for port in ports),
            "revoked": sum(port.revoked for port in ports),
            "flooding": sum(port.flooding for port in ports),
            "crowded": sum(port.crowded for port in ports),
            "heavy": sum(port.heavy for port in ports),
            "malformed": sum(port.rejected for port in ports),
        }

    def _tcp(self) -> TcpFigures:
        if self._sockets is None or self._owner is None:
            return TcpFigures()
        return self._sockets.tcp_figures(self._owner)


def main(arguments: Sequence[str]) -> None:
    """Run the keeper of the settings in `arguments`, as JSON, until its channel ends."""
    channel, (text,) = companion_channel(arguments, ROOM_BYTES)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY_BYTES, MEMORY_BYTES))
    raise_descriptor_limit()
    raise_priority()
    with closing(channel), ExitStack() as opened:
        try:
            Keeper(msgspec.json.decode(text, type=DoorSettings), channel, opened).run()
        except ConfigurationError as error:
            channel.send(encode(Failed(str(error))))
            channel.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
