"""Bad input gives one clear line that names the value and what would be valid, and exit code 2."""

import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest

import feelahead.main
import operator_side.main
import robot_side.main
from common.errors import ConfigurationError

ARM_WITHOUT_ACTUATORS = """
<mujoco>
  <worldbody>
    <body><joint name="turn" axis="0 0 1"/><geom size="0.1"/><site name="tip" pos="0 0 0.1"/></body>
  </worldbody>
</mujoco>
"""

Command = Callable[[Sequence[str]], int]


def complaint(command: Command, *arguments: str) -> str:
    with pytest.raises(ConfigurationError) as caught:
        command(arguments)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.fixture
def taken_port() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server.getsockname()[1]


ROBOT = robot_side.main.command
OPERATOR = operator_side.main.command
DEMO: Command = lambda arguments: feelahead.main.command(["demo", *arguments])  # noqa: E731


@pytest.mark.parametrize(
    ("command", "arguments", "named", "valid"),
    [
        (ROBOT, ["--probability", "1"], "1.0", "0 < probability < 1"),
        (ROBOT, ["--probability", "-0.5"], "-0.5", "0 < probability < 1"),
        (ROBOT, ["--probability", "nan"], "nan", "0 < probability < 1"),
        (ROBOT, ["--link", "delay -5ms"], "-5ms", "0"),
        (ROBOT, ["--link", "delay 5"], "'5'", "50ms"),
        (ROBOT, ["--link", "delay 5ms distribution normal"], "distribution", "JITTER"),
        (OPERATOR, ["--link", "to_mars: delay 5ms"], "to_mars", "to_robot"),
        (OPERATOR, ["--connect", "tcp://127.0.0.1"], "tcp://127.0.0.1", "tcp://HOST:PORT"),
        (OPERATOR, ["--connect", "127.0.0.1:5555"], "127.0.0.1:5555", "tcp://HOST:PORT"),
        (OPERATOR, ["--connect", "tcp://127.0.0.1:99999"], "99999", "65535"),
        (ROBOT, ["--bind", "udp://127.0.0.1:5555"], "udp://127.0.0.1:5555", "tcp://HOST:PORT"),
        (ROBOT, ["--bind", "tcp://0.0.0.0:5555"], "0.0.0.0", "--insecure"),
        (ROBOT, ["--model", "missing.xml", "--site", "tip"], "missing.xml", "MJCF"),
        (ROBOT, ["--model", "/", "--site", "tip"], "--model /: is a directory", "MJCF"),
        (ROBOT, ["--scene", "table", "--model", "x.xml", "--site", "tip"], "--scene table with --model", "one of them"),
        (DEMO, ["--scene", "table", "--model", "x.xml", "--site", "tip"], "--scene table with --model", "one of them"),
        (ROBOT, ["--site", "tip"], "--site", "--model"),
        (ROBOT, ["--camera.sd-m", "-1"], "-1", "0"),
        (ROBOT, ["--duration", "-3"], "-3", "above 0"),
        (OPERATOR, ["--device", "keyboard"], "keyboard", "simulated"),
        (DEMO, ["--link", "dealy 5ms"], "dealy", "delay"),
        (ROBOT, ["--asymmetry", "12"], "'12'", "50ms"),
        (OPERATOR, ["--asymmetry=-11s"], "-11s", "10s"),
        (DEMO, ["--duration", "soon"], "soon", "a number"),
        (ROBOT, ["--law", "first"], "first", "swept"),
        (DEMO, ["--law", "none"], "none", "swept"),
        (OPERATOR, ["--compensation", "nobody"], "nobody", "robot"),
        (DEMO, ["--compensation", "nobody"], "nobody", "robot"),
        (feelahead.main.command, ["dmeo"], "dmeo", "demo"),
        (DEMO, ["--tui"], "--tui", "a terminal"),
        (OPERATOR, ["--tui"], "--tui", "a terminal"),
        (DEMO, ["--tui", "--status", "json"], "--status json", "one of them"),
        (OPERATOR, ["--tui", "--status", "none"], "--status none", "one of them"),
    ],
)
def test_one_line_names_the_value_and_what_is_valid(
    command: Command, arguments: list[str], named: str, valid: str
) -> None:
    text = complaint(command, *arguments)
    assert named in text
    assert valid in text


def test_an_unknown_site_lists_the_sites() -> None:
    model = Path(robot_side.main.__file__).parent / "simulation" / "assets" / "arm.xml"
    text = complaint(ROBOT, "--bind", "tcp://127.0.0.1:0", "--model", str(model), "--site", "hand")
    assert "'hand'" in text
    assert "tool" in text


def test_a_model_without_actuators_is_named(tmp_path: Path) -> None:
    path = tmp_path / "bare.xml"
    path.write_text(ARM_WITHOUT_ACTUATORS)
    text = complaint(ROBOT, "--bind", "tcp://127.0.0.1:0", "--model", str(path), "--site", "tip")
    assert "actuator" in text


def test_malformed_toml_is_named(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    path.write_text("probability = = 1")
    assert "settings.toml" in complaint(ROBOT, "--config", str(path))
    path.write_text("[camera]\nsd_mm = 3")
    assert "camera.sd_mm" in complaint(ROBOT, "--config", str(path))


def test_a_port_in_use_is_named(taken_port: int) -> None:
    text = complaint(ROBOT, "--bind", f"tcp://127.0.0.1:{taken_port}")
    assert str(taken_port) in text
    assert "in use" in text


@pytest.mark.processes
@pytest.mark.parametrize(
    ("module", "arguments", "named"),
    [
        ("robot_side.main", ["--probability", "1"], "probability"),
        ("operator_side.main", ["--connect", "nowhere"], "nowhere"),
        ("feelahead.main", ["demo", "--no-console", "--model", "missing.xml", "--site", "tip"], "missing.xml"),
        ("feelahead.main", ["demo", "--no-console", "--probability", "1"], "probability"),
    ],
)
def test_the_process_ends_with_code_2_and_one_line(module: str, arguments: list[str], named: str) -> None:
    ended = subprocess.run(
        [sys.executable, "-P", "-m", module, *arguments], capture_output=True, text=True, timeout=300, check=False
    )
    assert ended.returncode == 2
    [line] = ended.stderr.strip().splitlines()
    assert named in line
    assert "Traceback" not in ended.stderr
