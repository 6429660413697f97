"""The process `feelahead-robot`: sockets, clock, core; nothing else."""

import secrets
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

from common.clock import MonotonicClock, ThreadClock, clock_domain
from common.command.command_line import parse_settings, run_command
from common.command.ending import end_with, failure_of
from common.command.live_view import SLOW
from common.command.status import Status
from common.command.stop_signal import LeavingAtOnce, StopSignal
from common.emulation.spec import LinkSpec, unused_clauses
from common.emulation.tuned import tuned_link
from common.protocol.view_messages import VIEW_NAMES
from common.realtime.garbage import IdleCollection
from common.realtime.keeping_up import KeepingUp
from common.realtime.pacing import Pacer, wait_for_turn
from common.realtime.priority import make_realtime, raise_descriptor_limit, raise_priority
from common.realtime.stages import Stages, microseconds
from common.recording.side import SideRecording, recording_to
from common.sockets.admission import Admission
from common.sockets.authentication import RobotKeys
from common.sockets.robot import RobotSockets
from common.statistics import RunningStatistics
from robot_side.compiled.warm_up import warm_up
from robot_side.core import RobotParts, RobotSide
from robot_side.drivers.remote.beside import Beside
from robot_side.events import Listener
from robot_side.parts import SimulatedParts, build_parts
from robot_side.recording.recorder import Recorder, RobotEncoder, recorded_status, robot_header
from robot_side.reporting.link_reporter import LinkReporter
from robot_side.reporting.sending import SENT_STREAMS, Sending
from robot_side.settings import RobotSettings
from robot_side.turn_stages import HELPS, STAGES, StageTiming
from robot_side.viewing.looking import Looking
from robot_side.viewing.perceived_shapes import PerceivedModel
from robot_side.viewing.pictures import Cameras
from robot_side.viewing.scene_view import SceneView
from robot_side.viewing.shapes import SceneModel

TICK_PERIOD_S = 1e-3
KEYS_PERIOD_S = 0.2
"""How often the allow-list is looked at, so that a revoked operator is out within a second."""

_COMPILING = (
    "compiling for this processor, about half a minute; the next start is quick (to do it beforehand: feelahead doctor"
    " --compile)"
)


def main() -> None:
    """The console script."""
    run_command("feelahead-robot", command)


def command(arguments: Sequence[str], build: Callable[[RobotParts, Sequence[Listener]], RobotSide] = RobotSide) -> int:
    """Run the robot side until --duration, Ctrl-C or SIGTERM; the arm stands still on every way out.

    build: makes the core.
    """
    settings = parse_settings(RobotSettings, "feelahead-robot", arguments)
    link = settings.link_spec()
    keys = None if settings.keys is None else RobotKeys.load(settings.keys)
    raise_descriptor_limit()
    # Nothing moves yet, and a compilation cannot be asked to stop.
    leaving = LeavingAtOnce(settings.summary)
    open_sockets = partial(RobotSockets, settings.bind, settings.view_bind, insecure=settings.insecure, keys=keys)
    # A port that is taken is said at once.
    open_sockets().close()
    with (
        Status(settings.status, "robot") as status,
        recording_to(settings.record, "robot", RobotEncoder()) as recording,
        Beside(settings.arm, settings.objects, status.note, insecure=settings.insecure, keys=keys) as beside,
    ):
        epoch = secrets.randbits(53)
        stages = Stages(STAGES, MonotonicClock(), ThreadClock(), settings.seed)
        parts = build_parts(settings, epoch, clock_domain(), announce=status.note, beside=beside)
        listeners: list[Listener] = [StageTiming(stages)]
        core = build(parts, listeners if recording is None else [*listeners, Recorder(recording.noted.append)])
        sent = [stream for stream in SENT_STREAMS if settings.cameras.on or stream != "video"]
        for text in (*parts.notes, *unused_clauses(link, [("to_operator", stream) for stream in sent])):
            status.note(text)
        warm_up(lambda: status.note(_COMPILING), parts.kernels)
        beside.wait()
        if recording is not None:
            recording.begin(robot_header(settings, epoch, clock_domain()) | {"notes": parts.notes})
            status.also = recording.note
        model = PerceivedModel(parts.scene) if parts.any_objects else SceneModel(parts.scene)
        view = SceneView(model, parts.kinematics, parts.explains)
        with ExitStack() as stack:
            stop = stack.enter_context(StopSignal())
            leaving.summary = None
            raise_priority()
            for text in make_realtime() if settings.realtime else ():
                status.note(text)
            # Last: who connects is heard at once, and no crowd takes what is still to be opened.
            sockets = stack.enter_context(open_sockets())
            loop = _Loop(settings, core, parts, view, link, sockets, status, recording, stages)
            status.note(f"listening at {sockets.control_endpoint}, view at {sockets.view_endpoint}")
            open_to_all = ["WITHOUT KEYS: anyone who reaches the port can move the arm"] if settings.insecure else []
            for text in open_to_all if keys is None else keys.notes():
                status.note(text)
            status.event("listening", control=sockets.control_endpoint, view=sockets.view_endpoint)
            failure = failure_of(partial(loop.run, stop))
            # A run that failed has figures, too.
            summary = loop.summary() | core.summary() | {"beside": beside.summary()}
            if recording is not None:
                summary["recording"] = recording.close()
            try:
                end_with(summary, settings.summary, failure)
            finally:
                loop.close()
    return 0


class _Loop:
    """Ticks at absolute deadlines, messages as they come, and all that may wait after the tick's messages have left."""

    def __init__(
        self,
        settings: RobotSettings,
        core: RobotSide,
        parts: SimulatedParts,
        view: SceneView,
        link: LinkSpec,
        sockets: RobotSockets,
        status: Status,
        recording: SideRecording | None,
        stages: Stages,
    ) -> None:
        self._recording = recording
        self._duration_s = settings.duration
        self._core = core
        self._link = link
        self._sockets = sockets
        self._status = status
        self._clock = MonotonicClock()
        self._computed = ThreadClock()
        self._arm = parts.simulation
        self._arm.give_way(self._clock)
        self._told_slow = False
        self._admission = Admission()
        self._tick_time = RunningStatistics(settings.seed)
        self._tick_cpu_time = RunningStatistics(settings.seed)
        self._latest_tick_times_s: deque[float] = deque(maxlen=1000)
        self._sending = Sending(link, sockets, secrets.randbits(32))
        self._looking = Looking(
            core,
            view,
            Cameras(parts.scene, settings.cameras, status.note) if settings.cameras.on else None,
            self._sending,
            always=() if recording is None else (*VIEW_NAMES, "scene"),
            seed=settings.seed,
        )
        self._reporter = LinkReporter(
            core.session, self._sending.budget, lambda: self._looking.pictures, sockets.tcp_figures
        )
        self._collection = IdleCollection(self._clock)
        self._start_s = self._clock.now()
        self._pacer = Pacer(TICK_PERIOD_S, self._start_s, settings.seed)
        self._keeping_up = KeepingUp(self._pacer, stages, self._clock, self._computed, HELPS)
        self._stages = stages
        self._next_keys_s = self._start_s

    def run(self, stop: StopSignal) -> None:
        """Go on until `stop` or --duration."""
        with self._collection:
            self._start_s = self._clock.now()
            self._pacer.restart(self._start_s)
            receive, send = (
                self._stages.timed("sockets", self._sockets.receive),
                self._stages.timed("sockets", self._send),
            )
            hear = self._stages.timed("messages", self._core.receive)
            while not stop.is_set:
                self._keeping_up.begin()
                received = receive()
                # Read after receiving: a process that was stopped in between must not take old commands for new.
                now_s = self._clock.now()
                if self._duration_s is not None and now_s - self._start_s >= self._duration_s:
                    break
                for peer, payload in self._admission.admitted(received, self._core.session.owner_peer):
                    hear(peer, payload, now_s)
                ticked = self._pacer.due(now_s)
                if ticked:
                    self._tick(now_s)
                send()
                if ticked:
                    self._use_idle_time(self._clock.now(), now_s)
                    self._core.observe(now_s)
                if (said := self._keeping_up.end(turned=ticked)) is not None:
                    self._status.note(said)
                wait_for_turn(self._pacer, self._clock, self._sockets.wait, self._sending.next_due())

    def summary(self) -> dict[str, Any]:
        """The process's part of the run's figures."""
        sockets, stages = self._sockets, self._stages.summary()
        paced = self._pacer.summary()
        return {
            "duration_s": self._clock.now() - self._start_s,
            "tick_us": microseconds(self._tick_time),
            "tick_cpu_us": microseconds(self._tick_cpu_time),
            "physics_us": stages["physics"]["wall_us"],
            "stages": {"robot": stages},
            "machine": {"robot": self._keeping_up.summary()},
            **paced,
            "link": self._sending.summary(),
            "rate": {"robot": self._sending.budget.summary() | {"pictures": self._looking.pictures}},
            "simulation": {"share_of_real_time": self._arm.share_of_real_time},
            "looked_at": self._looking.summary(),
            "pacing": {"robot": paced | {"garbage": self._collection.summary()}},
            "strangers": {
                "refused": sockets.refused,
                "revoked": sockets.revoked,
                "flooding": sockets.flooding,
                "crowded": sockets.crowded,
                "malformed": sockets.rejected,
                "unread": self._admission.unread,
            },
        }

    def _tick(self, now_s: float) -> None:
        self._pacer.begin(now_s)
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

    def _send(self) -> None:
        session = self._core.session
        self._sending.send(None if session.owner_peer is None else session.link.outgoing, self._clock.now())

    def _paced(self) -> dict[str, float | int]:
        """The ticks since this was last asked for."""
        share = self._arm.take_share_of_real_time()
        if max(share, self._arm.share_of_real_time) < SLOW and not self._told_slow:
            self._told_slow = True
            self._status.note(
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
        """End what runs beside."""
        self._looking.close()

    def _use_idle_time(self, now_s: float, ticked_s: float) -> None:
        """What no tick should wait for. ticked_s: the newest tick's `now`."""
        seen = self._looking.idle(now_s, ticked_s)
        self._sending.push(seen, now_s)
        if self._recording is not None:
            for message in seen:
                self._recording.view(now_s, message.payload)
            for text in self._recording.idle(
                now_s, lambda: recorded_status(self._core, now_s) | self._reporter.status()
            ):
                self._status.note(text)
        self._sending.push(self._reporter.due(now_s), now_s)
        if self._status.due(now_s):
            self._status.show(now_s, self._core.status(now_s) | self._paced() | self._reporter.status())
        if now_s >= self._next_keys_s:
            self._next_keys_s = now_s + KEYS_PERIOD_S
            self._sockets.refresh_keys()
            for text in self._sockets.news():
                self._status.note(text)
        tuning = self._core.session.tuning
        for text in tuning.take_notes():
            self._status.note(text)
        if (words := tuning.take_link()) is not None:
            self._link = tuned_link(self._link, words)
            self._sending.change(self._link)
        self._collection.idle(now_s, resting=self._core.session.safety.state != "armed")


if __name__ == "__main__":
    main()
