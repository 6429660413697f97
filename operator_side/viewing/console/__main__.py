"""Console process: passes facts from the operator side to viser and the pages, and the pages' messages back.

Each message on the channel begins with a letter:

operator side ──▶ here    o, first, the port and the token, f facts, v a view payload as received, n a note,
                          r the constants of a run, p the position in a recording, d the run's normal end
here ──▶ operator side    a the address, w the number of visible pages, s a page's message, e why there is no console,
                          t how late the pages' answers are, and the share of pictures that they skip,
                          l the H.264 pictures that are lacking: first once H.264 can be shown, then at each change
"""

import asyncio
import contextlib
import logging
import math
import os
import select
import socket
import struct
import sys
import threading
from collections.abc import Iterator
from itertools import islice
from typing import Any, Final
from urllib.parse import urlsplit

import msgspec

from common.command.live_view import LiveView
from common.command.words import lease_words, link_words, words
from common.companion.channel import Channel
from common.companion.process import companion_channel
from common.errors import RemoteProtocolError
from common.extras import installing
from common.protocol.codec import decode_view
from common.protocol.view_messages import (
    VIEW_NAMES,
    AnyViewMessage,
    SceneShapes,
    SceneState,
    VideoFrame,
    VideoStep,
)
from common.realtime.priority import lower_priority
from common.roles import ROLES, Role
from common.status.codes import Border, InputSource
from operator_side.controller.feel import SENSED_TRAVEL
from operator_side.viewing.facts import OperatorFacts, ShownKind

_NICENESS: Final = 0
"""Niceness of this process, the browser's, as the page waits for it; both sides have priority"""
_FRAME: Final = struct.Struct("<Bd")
"""Header of a picture: number of its view, and its capture time on the robot side's clock"""
_MOST_LISTED: Final = 6
_LAST_WORDS_S: Final = 0.3
"""Seconds that pages have to receive the last message before the process ends"""
_SLOW_PERIOD_S: Final = 0.25
"""Seconds between scene updates if a browser draws without a graphics processor"""
_LATENESS_PERIOD_S: Final = 0.25
_LASTING: Final = {b"r": ShownKind.RUN, b"p": ShownKind.PLAYER}


class _Process:
    """Console process. After the start, everything runs in the server's thread."""

    def __init__(self, channel: Channel) -> None:
        self._skipped = 0
        self._channel = channel
        self._facts: OperatorFacts | None = None
        self._shapes: SceneShapes | None = None
        self._ended = threading.Event()
        self._drawing: Any = None
        self._cues: Any = None
        self._pages: Any = None
        self._gate: Any = None
        self._drawn_s = -math.inf
        self._steps: Any = None
        self._lacks: tuple[int, int] | None = None
        self._early: list[bytes] = []
        """Messages that came before this process served"""

    def run(self) -> None:
        """Serve until the channel ends. If serving is impossible, report the reason through the channel."""
        lower_priority(_NICENESS)
        while not self._early and not self._channel.ended:
            select.select([self._channel], [], [])
            self._early += self._channel.receive()
        if not self._early:
            return
        port, token = msgspec.msgpack.decode(self._early.pop(0)[1:], type=tuple[int, str])
        try:
            from operator_side.viewing.console.cues import Cues  # noqa: PLC0415  # an extra, and slow to import
            from operator_side.viewing.console.drawing import Drawing  # noqa: PLC0415
            from operator_side.viewing.console.gate import Gate  # noqa: PLC0415
            from operator_side.viewing.console.pages import Pages  # noqa: PLC0415
            from operator_side.viewing.console.proof import prove  # noqa: PLC0415
            from operator_side.viewing.console.server import Server  # noqa: PLC0415
            from operator_side.viewing.console.solids import sphere  # noqa: PLC0415
        except ModuleNotFoundError as error:
            missing = (error.name or "").partition(".")[0]
            self._give_up(f"{missing} is not installed; to install it: {installing('operator')}")
            return
        part = socket.socket()
        part.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            part.bind(("127.0.0.1", port))
        except OSError as error:
            self._give_up(f"--console-port {port}: {error.strerror}; valid: a free port, or 0 to choose one")
            return
        port = part.getsockname()[1]
        self._gate = gate = Gate(token, port)
        self._pages = Pages(lambda count: self._say("w", b"%d" % count), self._say)
        try:
            server = Server(gate, self._pages, part)
        except RuntimeError as error:
            self._give_up(str(error))
            return
        self._drawing, self._cues = Drawing(server.viser), Cues()
        if (hole := prove(port, token)) is not None:
            self._give_up(f"its protection against other programs and pages failed a check: {hole}")
            return
        assert server.loop is not None  # noqa: S101  # Server guarantees it
        server.loop.call_soon_threadsafe(self._begin, server.loop, gate.address)
        # Late, as both take up to a second: the first shape, and H.264, without which pictures are JPEG.
        sphere(1)
        with contextlib.suppress(ImportError, ValueError):
            from common.video.steps import Steps  # noqa: PLC0415  # an extra

            server.loop.call_soon_threadsafe(self._follow, Steps())
        self._ended.wait()

    def _begin(self, loop: Any, address: str) -> None:
        self._say("a", address.encode())
        self._tell_lateness(loop)
        loop.call_soon(self._receive)
        loop.add_reader(self._channel.fileno(), self._receive)

    def _tell_lateness(self, loop: Any) -> None:
        if (late := self._pages.late(loop.time())) is not None:
            self._say("t", msgspec.msgpack.encode(late))
        loop.call_later(_LATENESS_PERIOD_S, self._tell_lateness, loop)

    def _follow(self, steps: Any) -> None:
        self._steps = steps
        self._say_what_lacks()

    def _say(self, kind: str, content: bytes) -> None:
        self._channel.send(kind.encode(), content)

    def _give_up(self, why: str) -> None:
        self._say("e", why.encode())
        while self._channel.waiting and not self._channel.ended:
            self._channel.flush()

    def _receive(self) -> None:
        try:
            state: SceneState | None = None
            early, self._early = self._early, []
            for message in (*early, *self._channel.receive()):
                state = self._take(message[:1], message[1:]) or state
            if state is not None:
                with self._skipping():
                    self._show_scene(state)
        except Exception as error:  # it would recur with every message
            self._give_up(f"the console failed: {error!r}")
            self._ended.set()
        if self._channel.ended:
            loop = asyncio.get_running_loop()
            loop.remove_reader(self._channel.fileno())
            loop.call_later(_LAST_WORDS_S, self._ended.set)

    def _take(self, kind: bytes, content: bytes) -> SceneState | None:
        """Take one message. Return a scene's state instead of drawing it: the caller draws only the newest."""
        if kind == b"f":
            self._facts = facts = msgspec.msgpack.decode(content, type=OperatorFacts)
            at = [None if trigger.raw is None else SENSED_TRAVEL * trigger.raw for trigger in (facts.l2, facts.r2)]
            shown = {"kind": ShownKind.FACTS, "facts": facts, "said": said(facts), "fingers": at}
            self._pages.show(ShownKind.FACTS, msgspec.json.encode(shown).decode())
        elif kind == b"n":
            note = {"kind": ShownKind.NOTE, "text": content.decode("utf-8", "replace")}
            self._pages.note(msgspec.json.encode(note).decode())
        elif kind == b"d":
            self._pages.show(ShownKind.ENDED, f'{{"kind":"{ShownKind.ENDED}"}}', lasting=True)
        elif kind in _LASTING:
            lasting = {"kind": _LASTING[kind], **msgspec.msgpack.decode(content)}
            if back := lasting.get("back"):
                self._gate.back = "{0.scheme}://{0.netloc}".format(urlsplit(back))
            self._pages.show(_LASTING[kind], msgspec.json.encode(lasting).decode(), lasting=True)
        elif kind == b"v":
            with self._skipping():
                return self._view(content)
        return None

    @contextlib.contextmanager
    def _skipping(self) -> Iterator[None]:
        """Skip a view message that cannot be shown, and say so once: the robot side is a stranger here."""
        try:
            yield
        except RemoteProtocolError:
            pass
        except Exception as error:
            if not self._skipped:
                text = f"a view of the robot side cannot be shown, and is skipped: {error!r}"
                self._pages.note(msgspec.json.encode({"kind": ShownKind.NOTE, "text": text}).decode())
            self._skipped += 1

    def _view(self, payload: bytes) -> SceneState | None:
        seen: AnyViewMessage | None = decode_view(payload)
        if isinstance(seen, VideoStep):
            seen = None if self._steps is None else self._steps.decode(seen)
            self._say_what_lacks()
        if isinstance(seen, VideoFrame):
            before = _FRAME.pack(VIEW_NAMES.index(seen.view), seen.captured_s)
            self._pages.show(seen.view, before + seen.jpeg)
        elif isinstance(seen, SceneShapes):
            self._shapes = seen
            self._cues.shapes(seen)
            self._drawing.shapes(seen)
        elif isinstance(seen, SceneState):
            return seen
        return None

    def _say_what_lacks(self) -> None:
        if self._steps is not None and self._steps.lacks != self._lacks:
            self._lacks = self._steps.lacks
            self._say("l", msgspec.msgpack.encode(self._lacks))

    def _show_scene(self, state: SceneState) -> None:
        facts, names = self._facts, () if self._shapes is None else self._shapes.objects
        if not self._pages.slow or abs(state.taken_s - self._drawn_s) >= _SLOW_PERIOD_S:
            self._drawn_s = state.taken_s
            needed_m = (None, None) if facts is None else (facts.l2.needed_m, facts.r2.needed_m)
            self._drawing.state(state, needed_m, "R2" if facts is None else facts.advancing)
        total_l2, total_r2 = (sum(row[column] for row in state.overlaps) for column in (1, 2))
        listed = sorted(state.overlaps, key=lambda row: -max(row[1], row[2]))[:_MOST_LISTED]
        known = {index for index, _, _ in listed}
        targets = (index for index, role in enumerate(state.roles) if role == ROLES.index(Role.TARGET))
        listed += [(index, 0.0, 0.0) for index in islice(targets, _MOST_LISTED) if index not in known]
        scene = {
            "kind": ShownKind.SCENE,
            "overlap_mm3": (1e9 * total_l2, 1e9 * total_r2),
            "objects": [
                {
                    "name": names[index] if index < len(names) else "surfaces",
                    "role": _role(state, index).value,
                    "overlap_mm3": (1e9 * by_l2, 1e9 * by_r2),
                }
                for index, by_l2, by_r2 in listed
            ],
            "left_out": 0 if self._shapes is None else self._shapes.left_out,
            "sigma_mm": (1e3 * state.l2.sigma_m, 1e3 * state.r2.sigma_m),
            "tick_us": (state.tick_p50_us, state.tick_p99_us),
            "near": None if state.near is None else msgspec.structs.asdict(state.near),
            "unseen": state.unseen,
            **self._cues.of(state),
        }
        self._pages.show(ShownKind.SCENE, msgspec.json.encode(scene).decode())


def _role(state: SceneState, index: int) -> Role:
    """Return the role of an object; the last one for a number that is none."""
    return ROLES[min(state.roles[index], len(ROLES) - 1)] if index < len(state.roles) else Role.OBSTACLE


def said(facts: OperatorFacts) -> dict[str, Any]:
    """Return the texts that a page shows, and the colour of its border (`Border`); None for what is unknown."""
    status, view = facts.status, LiveView(None, facts.status)
    state = view.phase if view.alarm or view.border is Border.STARTING else words(view.border)
    return {
        "border": view.border,
        "state": state.upper(),
        "why": (None if state == view.phase else view.phase, view.reason),
        "link": link_words(status),
        "lease": lease_words(status.owner, reset_first=facts.reset_first) or None,
        "whose": "scripted person" if facts.hands is InputSource.PERSON else words(facts.hands),
        "holding": None if status.holding is None else f"{view.holding or 'nothing'}{view.stands}",
    }


def main() -> None:
    """Run the console process. Argument: the channel's file descriptor."""
    channel, _ = companion_channel(sys.argv[1:])
    logging.getLogger("websockets").setLevel(logging.CRITICAL)  # no line for each refused request
    _Process(channel).run()
    os._exit(0)  # does not wait for viser's thread


if __name__ == "__main__":
    main()
