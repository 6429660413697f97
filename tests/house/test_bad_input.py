"""Each command answers bad input with one clear line, which has the value and what is valid, and with exit code 2."""

import shlex
import socket
import subprocess
import sys

import pytest

import feelahead.main
import operator_side.main
import robot_side.main
from tests.helpers.refusal import refusal
from tests.helpers.repository import DATA, ROOT

COMMANDS = {
    "feelahead": feelahead.main.command,
    "feelahead-robot": robot_side.main.command,
    "feelahead-operator": operator_side.main.command,
}
ARM = ROOT / "robot_side" / "drivers" / "mujoco" / "assets" / "arm.xml"
WALL = DATA / "wall.xml"
KEY = "ab" * 32


def complaint(command: str) -> str:
    program, *arguments = shlex.split(command)
    return refusal(COMMANDS[program], arguments)


@pytest.mark.parametrize(
    ("command", "named", "valid"),
    [
        ("feelahead dmeo", "dmeo", "demo"),
        ("feelahead demo --link 'dealy 5ms'", "dealy", "delay"),
        ("feelahead demo --scene table --model x.xml --site tip", "--scene table and --model", "one of them"),
        ("feelahead demo --law none", "none", "swept"),
        ("feelahead demo --tui", "--tui", "a terminal"),
        ("feelahead demo --tui --status json", "--status json", "one of them"),
        ("feelahead demo --console-port 99999", "99999", "65535"),
        ("feelahead demo --probability nan", "nan", "above 0 and below 1"),
        ("feelahead demo --site tip", "--site is given without --model", "both"),
        ("feelahead demo --model missing.xml --site tip", "missing.xml", "an existing file"),
        ("feelahead demo --robot-config missing.toml", "missing.toml", "an existing file"),
        ("feelahead doctor --keys /tmp", "--keys", "both"),
        ("feelahead doctor --connect 127.0.0.1:5555", "'127.0.0.1:5555' is no address", "tcp://HOST:PORT"),
        ("feelahead doctor --connect tcp://*:5555", "names no host", "tcp://HOST:PORT"),
        ("feelahead doctor --connect tcp://127.0.0.1:65535", "--view-connect", "--view-connect"),
        ("feelahead doctor --view-connect tcp://127.0.0.1:5556", "--view-connect is given without --connect", "both"),
        ("feelahead doctor --connect tcp://127.0.0.1:1 --robot-key ab", "--robot-key is given without --keys", "both"),
        ("feelahead doctor --connect tcp://127.0.0.1:1 --keys /nowhere", "/nowhere", "feelahead keys make operator"),
        ("feelahead doctor --connect tcp://127.0.0.1", "tcp://127.0.0.1", "tcp://HOST:PORT"),
        ("feelahead keys", "ACTION", "--help"),
        ("feelahead keys allow anna --folder {folder}", "KEY", "--help"),
        ("feelahead keys allow anna abc --folder {folder}", "'abc'", "64"),
        (f"feelahead keys allow ../x {KEY} --folder {{folder}}", "'../x'", "letters"),
        ("feelahead keys revoke anna --folder {folder}", "'anna'", "valid"),
        ("feelahead keys show robot --folder {folder}", "{folder}", "feelahead keys make robot"),
        ("feelahead study", "no PROTOCOL.toml given", "feelahead study --help"),
        ("feelahead study chekc", "study chekc: no such action or file", "check"),
        ("feelahead study examples/study.toml", "no --out DIR given", "feelahead study --help"),
        ("feelahead study examples/study.toml --out / --simulated 0", "simulated = 0", "1 to 999"),
        ("feelahead study check examples/study.toml --out x", "--out", "feelahead study check --help"),
        ("feelahead study report", "no DIR given", "feelahead study --help"),
        ("feelahead replay x.mcap --speed 0", "speed", "0.01"),
        ("feelahead bench overlapp", "overlapp", "overlap"),
        ("feelahead bench overlap --truths 1", "truths = 1", "2 to"),
        ("feelahead bench overlap --peer-header /nowhere/overlap.hpp", "/nowhere/overlap.hpp", "pip download"),
        ("feelahead bench felt --picture out.png", "--picture out.png: errors have no figure", "valid: with --cover"),
        (f"feelahead bench felt --model {WALL}", "--model and --site", "all three"),
        ("feelahead bench stability --parts x", "--parts 'x': no such part", "valid: 'overlaps'"),
        ("feelahead bench felt --cover --site tcp", "--model and --site are given without one another", "valid"),
        ("feelahead bench felt --cover --model no_such.xml --site tool", "no_such.xml: there is no such file", "MJCF"),
        (f"feelahead bench felt --cover --model {WALL} --site hand", "'hand'", "tool"),
        ("feelahead bench error --table /", "--table /: is a folder", "a file in an existing folder"),
        ("feelahead bench link --link 'delay 5'", "'5'", "50ms"),
        ("feelahead bench link --against x.csv", "--against", "--virtual"),
        ("feelahead bench link --virtual --against nowhere.csv", "nowhere.csv", "delay_ns"),
        ("feelahead bench coverage --probabilities 0.9 1", "probabilities[1] = 1", "above 0 and at most 0.9999"),
        ("feelahead bench coverage --laws", "--laws", "one or more of swept"),
        ("feelahead bench coverage --laws swept swept", "--laws swept swept", "each once"),
        ("feelahead bench coverage --only 'no such cell'", "--only no such cell", "wall/bell/200 ms"),
        ("feelahead try demo --site-axis x", "--site-axis x is given without --model", "valid"),
        ("feelahead controller --trigger l2", "--trigger l2 without --measure-forces", "both"),
        ("feelahead-robot --probability nan", "nan", "0 < probability < 1"),
        ("feelahead-robot --link 'delay -5ms'", "-5ms", "0"),
        ("feelahead-robot --bind udp://127.0.0.1:5555", "udp://127.0.0.1:5555", "tcp://HOST:PORT"),
        ("feelahead-robot --bind tcp://0.0.0.0:5555", "0.0.0.0", "--insecure"),
        ("feelahead-robot --bind tcp://0.0.0.0:5555", "--insecure", "feelahead keys make robot"),
        ("feelahead-robot --bind tcp://127.0.0.1:0 --arm here", "--arm: 'here'", "tcp://HOST:PORT"),
        (
            "feelahead-robot --bind tcp://127.0.0.1:0 --objects tcp://0.0.0.0:0",
            "--objects: 'tcp://0.0.0.0:0'",
            "--keys",
        ),
        ("feelahead-robot --bind tcp://127.0.0.1:0 --model missing.xml --site tip", "missing.xml", "MJCF"),
        ("feelahead-robot --bind tcp://127.0.0.1:0 --model / --site tip", "--model /: is a directory", "MJCF"),
        (f"feelahead-robot --bind tcp://127.0.0.1:0 --model {ARM} --site hand", "'hand'", "tool"),
        ("feelahead-robot --bind tcp://127.0.0.1:0 --site tip", "--site", "--model"),
        ("feelahead-robot --bind tcp://127.0.0.1:0 --site-axis x", "--site-axis x is given without --model", "valid"),
        ("feelahead-robot --keys missing", "missing", "feelahead keys make robot --folder missing"),
        ("feelahead-robot --keys missing --insecure", "--insecure and --keys", "one of them"),
        ("feelahead-robot --config {toml}", "camera.sd_mm", "sd_m"),
        ("feelahead-robot --config {no_toml}", "none.toml", "TOML"),
        pytest.param("feelahead-robot --bind tcp://127.0.0.1:{port}", "{port}", "in use", marks=pytest.mark.processes),
        ("feelahead-operator --connect tcp://127.0.0.1:99999", "99999", "65535"),
        ("feelahead-operator --keys missing", "missing", "feelahead keys make operator --folder missing"),
        (f"feelahead-operator --robot-key {KEY}", "--robot-key is given without --keys", "both"),
        ("feelahead-operator --person.grasp-depth-m=-1", "--person.grasp-depth-m", "person.grasp_depth_m in the file"),
        ("feelahead-operator --calibration.left-stick.dead-zone=1", "left-stick.dead-zone", "in the file of --config"),
        ("feelahead-operator --config {person}", "person.grasp_depth_m", "at least 0"),
        ("feelahead-operator --config {calibration}", "dead_zone = 1", "below 1"),
        ("feelahead-operator --rendering.horizon-s=3", "--rendering.horizon-s = 3", "2"),
        ("feelahead-operator --swap-sides --pull-n=3", "--swap-sides and --pull-n", "valid"),
        ("feelahead-operator --tui --status=json", "--tui and --status json", "one of them"),
        ("feelahead-operator --asymmetry=-11s", "-11s", "10s"),
        ("feelahead-operator --tick-period 4", "--tick-period: '4'", "50ms"),
        ("feelahead-robot --tick-period 0.5ms", "--tick-period 0.5ms", "1ms to 20ms"),
        ("feelahead try approach --tick-period 21ms", "--tick-period 21ms", "1ms to 20ms"),
    ],
)
def test_one_line_names_the_value_and_what_is_valid(
    command: str, named: str, valid: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("bad")
    (folder / "some.toml").write_text("[camera]\nsd_mm = 3")
    (folder / "person.toml").write_text("[person]\ngrasp_depth_m = -1")
    (folder / "calibration.toml").write_text("[calibration.left_stick]\ndead_zone = 1")
    (folder / "none.toml").write_text("probability = = 1")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        given = {
            "folder": folder,
            "toml": folder / "some.toml",
            "person": folder / "person.toml",
            "calibration": folder / "calibration.toml",
            "no_toml": folder / "none.toml",
            "port": taken.getsockname()[1],
        }
        text = complaint(command.format(**given))
    assert named.format(**given) in text
    assert valid in text


def test_an_unset_flag_is_no_choice_and_choices_have_one_order() -> None:
    assert "None" not in complaint("feelahead controller --pattern hill")
    assert "one of ('shelf', 'slot', 'table', 'wall')." in complaint("feelahead demo --scene wal")


@pytest.mark.processes
@pytest.mark.parametrize(
    ("module", "arguments", "named"),
    [
        ("robot_side", ["--probability", "1"], "probability"),
        ("operator_side", ["--connect", "nowhere"], "nowhere"),
        ("feelahead", ["demo", "--no-console", "--model", __file__, "--site", "tip"], "an MJCF file"),
    ],
)
def test_the_process_ends_with_code_2_and_one_line(module: str, arguments: list[str], named: str) -> None:
    command = [sys.executable, "-P", "-m", module, *arguments]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert ended.returncode == 2
    [line] = ended.stderr.strip().splitlines()
    assert named in line
