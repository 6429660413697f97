"""Real robot side that sends views: pictures and steps arrive, also after its rendering process is killed."""

import os
import signal
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest

from common.protocol.view_messages import SceneShapes, SceneState, VideoFrame, VideoStep
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.summary import read_summary
from tests.helpers.machines.waiting import LIMIT_S
from tests.robot_side.viewing.viewer import Seen, Viewer, companion_of

pytestmark = pytest.mark.processes


def whole_and_steps(seen: Seen, after: int) -> bool:
    came = seen.of(VideoStep)
    return len(came) > 10 and any(step.whole and step.number > after for step in came)


def test_views_come_while_somebody_looks_and_a_killed_companion_comes_back(tmp_path: Path) -> None:
    path, reasons = tmp_path / "robot.json", list[str]()
    with SideProcess("robot_side", "robot", ["--bind=tcp://127.0.0.1:0", f"--summary={path}"]) as robot:
        listening = robot.wait_for("listening", LIMIT_S)
        with closing(Viewer(listening["control"], listening["view"], epoch=77)) as viewer:
            assert companion_of(robot.process_id) is None

            def works(seen: Seen) -> bool:
                """Return whether all views have come; skip the test if the robot side says why it cannot render."""
                reasons.extend(note for event in robot.events() if "cameras: " in (note := str(event.get("text"))))
                if reasons:
                    pytest.skip(reasons[0])
                cameras = {frame.view for frame in seen.of(VideoFrame)}
                return len(cameras) == 2 and bool(seen.of(SceneShapes) and seen.of(SceneState))

            for arrived_s, message in viewer.look_until(works, overview=True, first_person=True, scene=True).views:
                if isinstance(message, VideoFrame):
                    assert message.captured_s < message.header.sent_s < arrived_s
            newest = 0
            for _ in range(2):
                # A picture that is lacking brings a whole one, and steps follow.
                enough = partial(whole_and_steps, after=newest)
                steps = viewer.look_until(enough, overview=True, lacks=(newest, 0)).of(VideoStep)
                assert sum(step.whole for step in steps) < 5
                newest = steps[-1].number
            companion = companion_of(robot.process_id)
            assert companion is not None
            os.kill(companion, signal.SIGKILL)
            # Ticks continue: the owner's stiffness comes as before, and pictures again.
            viewer.look_until(lambda seen: seen.fields > 30 and companion_of(robot.process_id) is None, overview=True)
            viewer.look_until(lambda seen: len(seen.of(VideoFrame)) > 1, overview=True)
            assert companion_of(robot.process_id) not in (None, companion)
            # Whoever looks no longer gets no more.
            viewer.look_until(lambda seen: seen.fields > 50)
        assert robot.stop(LIMIT_S) == 0
    summary = read_summary(path)
    assert summary["errors"] == []
    assert summary["looked_at"]["companion"]["starts"] == 2
    assert summary["looked_at"]["overview"]["nobody_looks"] > 0
