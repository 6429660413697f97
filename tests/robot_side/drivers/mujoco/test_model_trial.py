"""Models that are small files and take MuJoCo gigabytes or minutes: refused in one line, by a process of its own."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import pytest

from common.errors import ConfigurationError
from robot_side.drivers.mujoco.brought import trial
from robot_side.drivers.mujoco.brought.trial import hearing_signals, try_model
from robot_side.drivers.mujoco.scene import load_scene
from tests.helpers.refusal import refusal

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has these limits")
ARM = '<body><joint type="hinge"/><geom size=".1"/><site name="tool"/></body>'
MANY = f'{2 * """<replicate count="10000" offset="1 0 0">"""}<geom size=".1"/></replicate></replicate>'
FIELD = '<hfield name="field" nrow="60000" ncol="60000" size="1 1 1 1"/>'
TEXTURE = '<texture name="texture" type="2d" builtin="flat" width="50000" height="50000"/>'
GRID = '<flexcomp type="grid" count="500 500 500" spacing=".1 .1 .1" name="flex" dim="3"/>'


def written(folder: Path, world: str = "", assets: str = "") -> Path:
    path = folder / "model.xml"
    path.write_text(f"<mujoco><asset>{assets}</asset><worldbody>{world}{ARM}</worldbody></mujoco>")
    return path


@pytest.mark.parametrize(
    ("world", "assets", "told"),
    [
        (GRID, "", "model model.xml: takes MuJoCo more than 0 GB of memory"),
        ('<geom type="hfield" hfield="field"/>', FIELD, "model model.xml: takes MuJoCo more than 0 GB of memory"),
        ("", TEXTURE, "Could not allocate memory for texture"),
        ("<geom size='-1'/>", "", "; valid: an MJCF file that MuJoCo compiles"),
    ],
)
def test_a_small_file_that_takes_much_memory_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, world: str, assets: str, told: str
) -> None:
    monkeypatch.setattr(trial, "_MOST_BYTES", 200 << 20)
    assert told in refusal(load_scene, written(tmp_path, world, assets), "tool")


def test_a_small_file_that_takes_much_time_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial, "_MOST_CPU_S", 1)
    assert "takes MuJoCo more than 1 s of processor time" in refusal(load_scene, written(tmp_path, MANY), "tool")


def test_a_compiler_that_crashes_takes_only_its_own_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mujoco.MjSpec, "from_file", lambda _: os.kill(os.getpid(), signal.SIGKILL))
    assert "ends MuJoCo's compiler by SIGKILL" in refusal(try_model, written(tmp_path))


def test_a_model_is_tried_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path)
    try_model(path)
    monkeypatch.setattr(os, "fork", lambda: pytest.fail("the model was tried again"))
    try_model(path)


def test_what_the_thread_raises_is_raised_here() -> None:
    assert hearing_signals(lambda: 3) == 3
    with pytest.raises(ConfigurationError, match="this model"):
        hearing_signals(lambda: refuse("this model"))


def refuse(what: str) -> Callable[[], None]:
    raise ConfigurationError(what)


STOPPED = """
import sys
from pathlib import Path
from common.command.stop_signal import LeavingAtOnce
from robot_side.drivers.mujoco import scene
LeavingAtOnce()
scene.{patched} = lambda *_: None
print("begun", flush=True)
scene.load_scene(Path(sys.argv[1]), "tool")
"""


@pytest.mark.processes
@pytest.mark.parametrize("patched", ["hearing_signals", "try_model"])
def test_a_stop_signal_ends_the_trial_and_the_loading_at_once(tmp_path: Path, patched: str) -> None:
    path = written(tmp_path, MANY)
    started = subprocess.Popen(
        [sys.executable, "-c", STOPPED.format(patched=patched), str(path)], stdout=subprocess.PIPE, text=True
    )
    assert started.stdout is not None
    with started:
        assert started.stdout.readline() == "begun\n"
        started.send_signal(signal.SIGTERM)
        assert started.wait() == 0  # that compiling takes for ever would be a failure by timeout
