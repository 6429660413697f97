"""The plug-in for LeRobot, with fakes of the classes and of the loop that it uses; tests/lerobot has the real ones."""

import importlib
import importlib.metadata
import sys
from collections.abc import Callable, Iterator
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar

import pytest

from tests.helpers.lerobot_fakes import FakeFollower, FakeSocket, use
from tests.helpers.repository import ROOT

PACKAGE = "lerobot_teleoperator_feelahead"
COMMAND = "lerobot.scripts.lerobot_teleoperate"


class FakeConfig:
    """LeRobot's TeleoperatorConfig, as far as it is used."""

    known: ClassVar[dict[str, type]] = {}

    @classmethod
    def register_subclass(cls, name: str) -> Callable[[type], type]:
        def register(found: type) -> type:
            cls.known[name] = found
            return found

        return register


class FakeTeleoperator:
    """LeRobot's Teleoperator, as far as it is used."""

    def __init__(self, config: FakeConfig) -> None:
        self.built_with = config


def teleop_loop(*, teleop: Any, robot: Any, turns: int = 3) -> list[dict[str, float]]:
    """Run some turns as LeRobot's loop does; return the actions."""
    actions = []
    for _ in range(turns):
        robot.get_observation()
        actions.append(robot.send_action(teleop.get_action()))
    return actions


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Fake of LeRobot 0.6.1 while lerobot-teleoperate runs; return its module."""
    running = SimpleNamespace(teleop_loop=teleop_loop)
    modules = {
        "lerobot": SimpleNamespace(),
        "lerobot.teleoperators": SimpleNamespace(),
        "lerobot.teleoperators.config": SimpleNamespace(TeleoperatorConfig=FakeConfig),
        "lerobot.teleoperators.teleoperator": SimpleNamespace(Teleoperator=FakeTeleoperator),
        COMMAND: running,
    }
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    release(monkeypatch, "0.6.1")
    return running


def release(monkeypatch: pytest.MonkeyPatch, version: str) -> None:
    """Let LeRobot have this version."""
    monkeypatch.setattr(importlib.metadata, "version", lambda name: {"lerobot": version}[name])


@pytest.fixture
def plugin(command: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    del command
    monkeypatch.syspath_prepend(ROOT / "plugins" / PACKAGE)
    yield importlib.import_module(PACKAGE)
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]


@pytest.fixture
def socket(plugin: ModuleType) -> FakeSocket:
    made = FakeSocket()
    use(made, importlib.import_module(f"{plugin.__name__}.lerobot_arm"))
    return made


def teleoperator(plugin: ModuleType) -> Any:
    return plugin.FeelaheadTeleop(plugin.FeelaheadTeleopConfig(address="tcp://127.0.0.1:5601"))


def test_the_loop_of_lerobot_drives_the_arm(plugin: ModuleType, socket: FakeSocket, command: SimpleNamespace) -> None:
    assert FakeConfig.known["feelahead"] is plugin.FeelaheadTeleopConfig
    follower, teleop = FakeFollower(), teleoperator(plugin)
    observe = follower.get_observation
    assert not teleop.is_connected
    teleop.connect()
    assert teleop.is_connected
    assert socket.address == "tcp://127.0.0.1:5601"
    socket.command([0.1, 0.0, 0.0, 0.0, 0.0], 1e9)
    actions = command.teleop_loop(teleop=teleop, robot=follower)
    assert [state["sequence"] for state in socket.sent] == [1, 2, 3]
    assert actions[0].keys() == teleop.action_features.keys()
    assert actions[0]["shoulder_pan.pos"] == pytest.approx(10.0)
    assert 10.0 < actions[1]["shoulder_pan.pos"] < actions[2]["shoulder_pan.pos"] < 11.0
    assert follower.get_observation == observe
    teleop.disconnect()
    assert not teleop.is_connected


def test_without_this_teleoperator_nothing_is_changed(plugin: ModuleType, command: SimpleNamespace) -> None:
    assert command.teleop_loop is teleop_loop
    teleoperator(plugin)
    follower, other = FakeFollower(), SimpleNamespace(get_action=lambda: FakeFollower().at)
    assert len(command.teleop_loop(teleop=other, robot=follower)) == 3
    assert command.teleop_loop.__name__ == "teleop_loop"
    wrapped = command.teleop_loop
    teleoperator(plugin)
    assert command.teleop_loop is wrapped


def test_a_failure_of_the_bus_is_told_and_ends_the_loop(
    plugin: ModuleType, socket: FakeSocket, command: SimpleNamespace
) -> None:
    follower, teleop = FakeFollower(), teleoperator(plugin)
    teleop.connect()
    command.teleop_loop(teleop=teleop, robot=follower)
    follower.dead = True
    with pytest.raises(ConnectionError, match="Present_Position"):
        command.teleop_loop(teleop=teleop, robot=follower)
    assert socket.sent[-1]["condition"] == "fault"
    assert socket.sent[-1]["condition_text"] == "robot: Failed to sync read 'Present_Position' after 3 tries."
    assert socket.sent[-2]["condition"] == "ready"


def test_a_bus_that_is_dead_from_the_start_is_not_told(
    plugin: ModuleType, socket: FakeSocket, command: SimpleNamespace
) -> None:
    follower, teleop = FakeFollower(), teleoperator(plugin)
    teleop.connect()
    follower.dead = True
    with pytest.raises(ConnectionError):
        command.teleop_loop(teleop=teleop, robot=follower)
    assert socket.sent == []
    with pytest.raises(RuntimeError, match="no observation"):
        teleop.get_action()


@pytest.mark.parametrize("version", ["0.4.4", "0.7.0", "1.0.6"])
def test_another_release_is_refused_in_one_line(
    plugin: ModuleType, version: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    release(monkeypatch, version)
    with pytest.raises(SystemExit) as ended:
        teleoperator(plugin)
    assert ended.value.code == 2
    assert capsys.readouterr().err == (
        f"feelahead: lerobot = {version}; valid: 0.6.x, whose loops this teleoperator knows\n"
    )


def test_another_program_is_refused_in_one_line(
    plugin: ModuleType, command: SimpleNamespace, capsys: pytest.CaptureFixture[str]
) -> None:
    del command.teleop_loop
    with pytest.raises(SystemExit) as ended:
        teleoperator(plugin)
    assert ended.value.code == 2
    assert "valid: lerobot-teleoperate or lerobot-record\n" in capsys.readouterr().err
