"""The work of the robot side in the turns of its loop: sockets and clocks around the core."""

import secrets
from collections import deque
from collections.abc import Sequence
from typing import Any, Final

from msgspec.structs import replace

from common.command.live_view import SLOW
from common.emulation.spec import LinkSpec
from common.emulation.tuned import tuned_link
from common.loop.process import Process
from common.protocol.view_messages import VIEW_NAMES
from common.realtime.stages import microseconds
from common.sockets.admission import Admission
from common.sockets.robot import RobotSockets
from common.statistics import RunningStatistics
from common.status.statuses import RobotStatus
from robot_side.core import RobotSide
from robot_side.drivers.remote.beside import Beside
from robot_side.reporting.link_reporter import LinkReporter
from robot_side.reporting.sending import Sending
from robot_side.settings import RobotSettings
from robot_side.viewing.looking import Looking
from robot_side.viewing.pictures import Cameras
from robot_side.viewing.scene_view import SceneView

KEYS_PERIOD_S: Final = 0.2
"""From one look at the allow-list to the next: a revoked operator is out within a second."""


class RobotTurns:
    """Ticks, messages, and what is shown."""

    def __init__(
        self,
        settings: RobotSettings,
        core: RobotSide,
        view: SceneView,
        cameras: Cameras | None,
        sockets: RobotSockets,
        process: Process,
        beside: Beside,
    ) -> None:
        """cameras: None where no pictures are made."""
        self._process, self._core, self._sockets, self._beside = process, core, sockets, beside
        self._clock, self._computed, self._pacer = process.loop.clock, process.loop.computed, process.loop.pacer
        self._link: LinkSpec = settings.link_spec()
        self._arm = core.parts.arm
        self._arm.give_way(self._clock)
        self._told_slow = False
        self._hear = process.loop.stages.timed("messages", core.receive)
        self._admission = Admission()
        self._tick_time, self._tick_cpu_time = RunningStatistics(settings.seed), RunningStatistics(settings.seed)
        self._latest_tick_times_s: deque[float] = deque(maxlen=1000)
        self._sending = Sending(self._link, sockets, secrets.randbits(32))
        always = () if process.recording is None else (*VIEW_NAMES, "scene")
        self._looking = Looking(core, view, cameras, self._sending, always=always, seed=settings.seed)
        self._reporter = LinkReporter(
            core.session, self._sending.budget, lambda: self._looking.pictures, sockets.tcp_figures
        )
        self._next_keys_s = self._clock.now()
        self.wait, self.receive, self.next_due = sockets.wait, sockets.receive, self._sending.next_due
        self.note = process.note

    @property
    def resting(self) -> bool:
        """The arm is not armed."""
        return self._core.session.safety.state != "armed"

    def take(self, received: Sequence[tuple[bytes, bytes]], now_s: float) -> None:
        """Give the core the payloads that are worth a look."""
        for peer, payload in self._admission.admitted(received, self._core.session.owner_peer):
            self._hear(peer, payload, now_s)

    def turn(self, now_s: float) -> None:
        """Tick."""
        self._admission.begin_tick()
        began_s, computed_s = self._clock.now(), self._computed.now()
        self._core.reports.felt.interval_s = self._sending.budget.haptic_interval_s
        outgoing = self._core.tick(now_s)
        self._tick_cpu_time.add(self._computed.now() - computed_s)
        took_s = self._clock.now() - began_s
        self._tick_time.add(took_s)
        self._latest_tick_times_s.append(took_s)
        self._looking.ticked(took_s, self._pacer.overruns)
        self._sending.push(outgoing, now_s)

    def send(self) -> None:
        """Let go of what is due."""
        session = self._core.session
        self._sending.send(None if session.owner_peer is None else session.link.outgoing, self._clock.now())

    def rest(self, now_s: float, turned_s: float) -> None:
        """Make what people look at, record, report, look at keys; then take in what came of the tick."""
        process = self._process
        seen = self._looking.idle(now_s, turned_s)
        self._sending.push(seen, now_s)
        if process.recording is not None:
            for message in seen:
                process.recording.view(now_s, message.payload)
            for text in process.recording.idle(now_s, lambda: self._status(now_s)):
                process.note(text)
        self._sending.push(self._reporter.due(now_s), now_s)
        if process.status.due(now_s):
            process.status.show(now_s, robot=replace(self._status(now_s), **self._paced()))
        if now_s >= self._next_keys_s:
            self._next_keys_s = now_s + KEYS_PERIOD_S
            self._sockets.refresh_keys()
            for text in self._sockets.news():
                process.note(text)
        tuning = self._core.session.tuning
        for text in tuning.take_notes():
            process.note(text)
        if (words := tuning.take_link()) is not None:
            self._link = tuned_link(self._link, words)
            self._sending.change(self._link)
        self._core.observe(turned_s)

    def _status(self, now_s: float) -> RobotStatus:
        return replace(self._core.status(now_s), **self._reporter.status())

    def _paced(self) -> dict[str, float | int]:
        """The ticks since this was last asked for."""
        share = self._arm.take_share_of_real_time()
        if max(share, self._arm.share_of_real_time) < SLOW and not self._told_slow:
            self._told_slow = True
            self._process.note(
                f"the simulation runs at {100.0 * share:.0f} % of real time: fewer free bodies, a longer timestep or"
                ' <flag sleep="enable"/> in the model would help'
            )
        latest_s = sorted(self._latest_tick_times_s) or [0.0]
        self._latest_tick_times_s.clear()
        return {
            "tick_us": 1e6 * latest_s[len(latest_s) // 2],
            "tick_p99_us": 1e6 * latest_s[len(latest_s) * 99 // 100],
            "overruns": self._pacer.overruns,
            "late_us": 1e6 * self._pacer.take_latest_s(),
            "real_time": share,
        }

    def close(self) -> None:
        """End the companion that renders."""
        self._looking.close()

    def summary(self) -> dict[str, Any]:
        """Return the core's figures and the process's."""
        sockets, stages = self._sockets, self._process.loop.stages.summary()
        figures = {
            "tick_us": microseconds(self._tick_time),
            "tick_cpu_us": microseconds(self._tick_cpu_time),
            "physics_us": stages["physics"]["wall_us"],
            **self._pacer.summary(),
            "link": self._sending.summary(),
            "rate": {"robot": self._sending.budget.summary() | {"pictures": self._looking.pictures}},
            "simulation": {"share_of_real_time": self._arm.share_of_real_time},
            "beside": self._beside.summary(),
            "looked_at": self._looking.summary(),
            "strangers": {
                "refused": sockets.refused,
                "revoked": sockets.revoked,
                "flooding": sockets.flooding,
                "crowded": sockets.crowded,
                "malformed": sockets.rejected,
                "unread": self._admission.unread,
            },
        }
        return figures | self._core.summary()
