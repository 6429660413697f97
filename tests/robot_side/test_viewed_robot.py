"""Real robot side that sends views: pictures arrive, also after its rendering process is killed, and on a slow link."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from common.protocol.view_messages import SceneShapes, SceneState, VideoFrame, VideoStep
from feelahead.both_sides.processes import SideProcess
from feelahead.both_sides.summary import read_summary
from robot_side.viewing.pictures import RETRY_S
from tests.robot_side.viewing.viewer import Seen, Viewer, companion_of, look

pytestmark = pytest.mark.processes
PATIENCE_S = 120.0


@contextmanager
def viewed(*arguments: str) -> Iterator[tuple[SideProcess, Viewer]]:
    with SideProcess("robot_side.main", "robot", ["--bind=tcp://127.0.0.1:0", *arguments]) as robot:
        listening = robot.wait_for("listening", 600.0)
        viewer = Viewer(listening["control"], listening["view"], epoch=77)
        try:
            yield robot, viewer
        finally:
            viewer.close()
            robot.stop()


def look_until(viewer: Viewer, enough: Callable[[Seen], bool], **what: Any) -> Seen:
    """Receive views for one second at a time, until `enough` is true of a second's messages; return these."""
    for _ in range(round(PATIENCE_S)):
        seen = look([viewer], 1.0, **what)
        if enough(seen):
            return seen
    return pytest.fail("the awaited views did not come")


def frames(seen: Seen) -> list[VideoFrame]:
    return [message for _, message in seen.views if isinstance(message, VideoFrame)]


def said_of_cameras(robot: SideProcess) -> list[str]:
    """Return the notes about cameras that the robot side has printed since the last call."""
    texts = [str(event.get("text")) for event in robot.events()]
    return [text for text in texts if text.startswith("cameras: ")]


def works_here(robot: SideProcess, viewer: Viewer) -> None:
    """Return once both cameras send pictures; skip the test if the robot side says why it cannot render."""
    for _ in range(round(PATIENCE_S)):
        if frames(look([viewer], 1.0, overview=True, first_person=True)):
            return
        for said in said_of_cameras(robot):
            pytest.skip(said)
    pytest.fail("neither pictures nor a reason")


def test_pictures_and_scene_come_while_somebody_looks_and_a_killed_companion_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "robot.json"
    with viewed(f"--summary={path}") as (robot, viewer):
        assert companion_of(robot.process_id) is None
        works_here(robot, viewer)
        both = look_until(
            viewer,
            lambda seen: {frame.view for frame in frames(seen)} == {"overview", "first_person"},
            overview=True,
            first_person=True,
            scene=True,
        )
        assert any(isinstance(message, SceneShapes) for _, message in both.views)
        assert any(isinstance(message, SceneState) for _, message in both.views)
        for arrived_s, message in both.views:
            if isinstance(message, VideoFrame):
                assert message.captured_s < message.header.sent_s < arrived_s
        companion = companion_of(robot.process_id)
        assert companion is not None
        os.kill(companion, signal.SIGKILL)
        gone = look([viewer], 1.0, overview=True)
        # Ticks continue: the owner's stiffness comes as before.
        assert len(gone.stiffness_ages_s) > 30
        again = look_until(viewer, lambda seen: bool(frames(seen)), overview=True)
        assert again.began_s - gone.began_s > RETRY_S - 2.0
        assert companion_of(robot.process_id) not in (None, companion)
        look([viewer], 0.5)
        assert look([viewer], 1.0).views == []
    summary = read_summary(path)
    assert summary["errors"] == []
    assert summary["looked_at"]["companion"]["starts"] == 2
    assert summary["looked_at"]["overview"]["nobody_looks"] > 0


def test_steps_go_to_viewers_that_show_them_and_a_missing_one_brings_a_whole_picture() -> None:
    pytest.importorskip("av", reason="needs the extra `video`")
    from common.video.steps import Steps  # noqa: PLC0415  # only now it is known to work

    followed, came = Steps(), list[VideoStep]()

    def take(seen: Seen) -> list[VideoStep]:
        new = [message for _, message in seen.views if isinstance(message, VideoStep)]
        assert all(followed.follow(step) is not None for step in new)
        came.extend(new)
        return new

    with viewed() as (robot, viewer):
        works_here(robot, viewer)
        look_until(viewer, lambda seen: bool(take(seen)), overview=True, lacks=(0, 0))
        take(look([viewer], 1.0, overview=True, lacks=(0, 0)))
        assert [step.number for step in came if step.whole] == [1]
        assert len(came) > 10
        lacks = came[-1].number
        look_until(viewer, lambda seen: any(step.whole for step in take(seen)), overview=True, lacks=(lacks, 0))
        take(look([viewer], 1.0, overview=True, lacks=(lacks, 0)))
        assert sum(step.whole for step in came) == 2
        assert [step.number for step in came] == list(range(1, len(came) + 1))
        look_until(viewer, lambda seen: bool(frames(seen)), overview=True)


def test_a_machine_that_cannot_render_is_told_what_helps(monkeypatch: pytest.MonkeyPatch) -> None:
    # PyOpenGL accepts only this platform, which no machine has.
    monkeypatch.setenv("EGL_PLATFORM", "none")
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    with viewed() as (robot, viewer):
        said: list[str] = []

        def is_said(_: Seen) -> bool:
            said.extend(said_of_cameras(robot))
            return bool(said)

        seen = look_until(viewer, is_said, overview=True)
        if "no pictures" not in said[0]:
            pytest.skip(f"OpenGL is there all the same: {said[0]}")
        assert "egl: " in said[0]
        assert "osmesa: " in said[0]
        assert "apt-get install libegl1" in said[0]
        assert len(seen.stiffness_ages_s) > 30
        look([viewer], 2.0, overview=True)
        assert said_of_cameras(robot) == []
