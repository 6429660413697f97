"""Bad input gives one clear line that names the value and what would be valid, and exit code 2: each command."""

import shlex
import socket
import subprocess
import sys

import pytest

import feelahead.main
import operator_side.main
import robot_side.main
from common.errors import ConfigurationError
from tests.helpers.repository import ROOT

COMMANDS = {
    "feelahead": feelahead.main.command,
    "feelahead-robot": robot_side.main.command,
    "feelahead-operator": operator_side.main.command,
}
ARM = ROOT / "robot_side" / "simulation" / "assets" / "arm.xml"


def complaint(command: str) -> str:
    program, *arguments = shlex.split(command)
    with pytest.raises(ConfigurationError) as caught:
        COMMANDS[program](arguments)
    text = str(caught.value)
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("command", "named", "valid"),
    [
        ("feelahead dmeo", "dmeo", "demo"),
        ("feelahead demo --link 'dealy 5ms'", "dealy", "delay"),
        ("feelahead demo --duration soon", "soon", "a number"),
        ("feelahead demo --scene table --model x.xml --site tip", "--scene table with --model", "one of them"),
        ("feelahead demo --law none", "none", "swept"),
        ("feelahead demo --compensation nobody", "nobody", "robot"),
        ("feelahead demo --tui", "--tui", "a terminal"),
        ("feelahead demo --tui --status json", "--status json", "one of them"),
        ("feelahead demo --console-port 99999", "99999", "65535"),
        ("feelahead doctor --keys /tmp", "--keys", "both"),
        ("feelahead doctor --connect tcp://127.0.0.1", "tcp://127.0.0.1", "tcp://HOST:PORT"),
        ("feelahead calibrate --device keyboard", "keyboard", "simulated"),
        ("feelahead keys frobnicate", "frobnicate", "make"),
        ("feelahead virtual-dualsense --duration 0", "0", "above 0"),
        ("feelahead replay", "no recording", "--record"),
        ("feelahead replay x.mcap --speed 0", "speed", "0.01"),
        ("feelahead export missing.mcap", "missing.mcap", "a recording"),
        ("feelahead plot missing.mcap", "missing.mcap", "a recording"),
        ("feelahead bench overlapp", "overlapp", "overlap"),
        ("feelahead try aproach", "aproach", "approach"),
        ("feelahead-robot --probability nan", "nan", "0 < probability < 1"),
        ("feelahead-robot --link 'delay -5ms'", "-5ms", "0"),
        ("feelahead-robot --bind udp://127.0.0.1:5555", "udp://127.0.0.1:5555", "tcp://HOST:PORT"),
        ("feelahead-robot --bind tcp://0.0.0.0:5555", "0.0.0.0", "--insecure"),
        ("feelahead-robot --model missing.xml --site tip", "missing.xml", "MJCF"),
        ("feelahead-robot --model / --site tip", "--model /: is a directory", "MJCF"),
        (f"feelahead-robot --bind tcp://127.0.0.1:0 --model {ARM} --site hand", "'hand'", "tool"),
        ("feelahead-robot --site tip", "--site", "--model"),
        ("feelahead-robot --camera.sd-m -1", "-1", "0"),
        ("feelahead-robot --config {toml}", "camera.sd_mm", "sd_m"),
        ("feelahead-robot --config {no_toml}", "none.toml", "TOML"),
        ("feelahead-robot --bind tcp://127.0.0.1:{port}", "{port}", "in use"),
        ("feelahead-operator --link 'to_mars: delay 5ms'", "to_mars", "to_robot"),
        ("feelahead-operator --connect tcp://127.0.0.1:99999", "99999", "65535"),
        ("feelahead-operator --device keyboard", "keyboard", "simulated"),
        ("feelahead-operator --asymmetry=-11s", "-11s", "10s"),
    ],
)
def test_one_line_names_the_value_and_what_is_valid(
    command: str, named: str, valid: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("bad")
    (folder / "some.toml").write_text("[camera]\nsd_mm = 3")
    (folder / "none.toml").write_text("probability = = 1")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        given = {"toml": folder / "some.toml", "no_toml": folder / "none.toml", "port": taken.getsockname()[1]}
        text = complaint(command.format(**given))
    assert named.format(**given) in text
    assert valid in text


@pytest.mark.processes
@pytest.mark.parametrize(
    ("module", "arguments", "named"),
    [
        ("robot_side", ["--probability", "1"], "probability"),
        ("operator_side", ["--connect", "nowhere"], "nowhere"),
        ("feelahead", ["demo", "--no-console", "--model", "missing.xml", "--site", "tip"], "missing.xml"),
    ],
)
def test_the_process_ends_with_code_2_and_one_line(module: str, arguments: list[str], named: str) -> None:
    command = [sys.executable, "-P", "-m", module, *arguments]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert ended.returncode == 2
    [line] = ended.stderr.strip().splitlines()
    assert named in line
