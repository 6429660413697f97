"""Work of the robot side in each turn of the loop: sockets and clocks around the core."""

import secrets
from collections.abc import Callable, Sequence
from typing import Any, Final

from msgspec.structs import replace

from common.loop.process import Process
from common.protocol.view_messages import VIEW_NAMES
from common.skipped import Part, shares
from common.sockets.door.client import Door
from common.status.statuses import RobotStatus
from robot_side.core.robot_side import RobotSide
from robot_side.drivers.remote.connected_drivers import ConnectedDrivers
from robot_side.reporting.audit import Audit, Log
from robot_side.reporting.link_reporter import LinkReporter
from robot_side.reporting.sending import Sending
from robot_side.settings import RobotSettings
from robot_side.tick_times import PhysicsTime, TickTimes
from robot_side.viewing.pictures import Cameras
from robot_side.viewing.scene_view import SceneView
from robot_side.viewing.view_scheduler import ViewScheduler

_LATE: Final = (
    "{} is compiled only now, which may stop the arm for seconds: a defect of this program, please report this line"
)


def audit_writer(log: Log | None, core: RobotSide, door: Door, note: Callable[[str], None]) -> Callable[[], None]:
    """Return a function that adds to `log` what happened since its last call. note: called once events are lost."""
    audit = None if log is None else Audit(log)

    def write() -> None:
        for text in [] if audit is None else audit.look(core.session, door.take_events()):
            note(text)

    return write


class RobotTurns:
    """Turns of the robot side: ticks, messages and views."""

    def __init__(
        self,
        settings: RobotSettings,
        core: RobotSide,
        view: SceneView,
        cameras: Cameras | None,
        door: Door,
        process: Process,
        drivers: ConnectedDrivers,
        physics: PhysicsTime,
        write_audit: Callable[[], None],
        kernels: Part,
    ) -> None:
        """cameras: None if no pictures are made. write_audit: adds what happened to the audit log, if there is one.

        kernels: those compiled by now.
        """
        self._process, self._core, self._door, self._drivers = process, core, door, drivers
        self._write_audit = write_audit
        core.parts.arm.give_way(process.loop.clock)
        self._times = TickTimes(process.loop, core.parts.arm, physics, process.note, settings.seed)
        self._sending = Sending(settings.link_spec(), door, secrets.randbits(32))
        always = () if process.recording is None else (*VIEW_NAMES, "scene")
        self._looking = ViewScheduler(core.session, view, cameras, self._sending, always=always, seed=settings.seed)
        self._reporter = LinkReporter(
            core.session, self._sending.budget, lambda: self._looking.pictures, door.tcp_figures
        )
        self._compiled, self._compiled_late = kernels, 0
        self.wait, self.receive, self.next_due = door.wait, door.receive, self._sending.next_due
        self.note = process.note

    def note_late(self, kernel: str) -> None:
        """Count and report a kernel that a turn has to compile, or to load, before it can go on."""
        self._compiled_late += 1
        self.note(_LATE.format(kernel))

    @property
    def resting(self) -> bool:
        """Whether the arm is not armed."""
        return self._core.session.safety.state != "armed"

    def handle(self, received: Sequence[tuple[bytes, bytes]], now_s: float) -> None:
        """Give the payloads to the core."""
        for peer, payload in received:
            self._core.receive(peer, payload, now_s)
        self._door.own(self._core.session.owner_peer)

    def turn(self, now_s: float) -> None:
        """Run one tick and queue its messages."""
        began = self._times.begin()
        self._core.reports.deadband.interval_s = self._sending.budget.haptic_interval_s
        outgoing = self._core.tick(now_s)
        self._looking.ticked(self._times.end(began), self._process.loop.pacer.overruns)
        self._sending.push(outgoing, now_s)

    def send(self) -> None:
        """Send the messages that are due."""
        session = self._core.session
        self._sending.send(
            None if session.owner_peer is None else session.link.outgoing, self._process.loop.clock.now()
        )

    def rest(self, now_s: float, turned_s: float) -> None:
        """Do what may wait: views, recording, reports, keys, tuning."""
        process = self._process
        seen = self._core.observe(turned_s) + self._looking.idle(now_s, turned_s, self._core.newest)
        self._sending.push(seen, now_s)
        if process.recording is not None:
            for message in seen:
                process.recording.view(now_s, message.payload)
            for text in process.recording.idle(now_s, lambda: self._status(now_s)):
                process.note(text)
        self._write_audit()
        self._sending.push(self._reporter.due(now_s), now_s)
        if process.status.due(now_s):
            process.status.show(now_s, robot=replace(self._status(now_s), **self._times.paced()))
        tuning, episodes = self._core.session.tuning, self._core.session.episodes
        late_stops = self._core.motion.following.stops
        for text in (*tuning.take_notes(), *episodes.take_notes(), *late_stops.take_notes()):
            process.note(text)
        if (words := tuning.take_link()) is not None:
            self._sending.tune(words)

    def _status(self, now_s: float) -> RobotStatus:
        return replace(self._core.status(now_s), **self._reporter.status())

    def close(self) -> None:
        """End the companion processes: the one that renders pictures, and the door."""
        self._looking.close()
        self._door.close()

    def summary(self) -> dict[str, Any]:
        """Return the figures of the core and of the process."""
        figures = {
            **self._process.loop.pacer.summary(),
            "link": self._sending.summary(),
            "rate": {"robot": self._sending.budget.summary() | {"pictures": self._looking.pictures}},
            "drivers": self._drivers.summary(),
            "looked_at": self._looking.summary(),
            "compiled_late": self._compiled_late,
            "strangers": self._door.counts(),
            "door": {"restarts": self._door.restarts, "dropped": self._door.dropped},
        }
        core = self._core.summary()
        kernels = self._compiled._replace(done=self._compiled.done + self._compiled_late)
        core["skipped"] |= shares(pictures=self._looking.pictures_sent, kernels=kernels)
        return self._times.summary() | figures | core
