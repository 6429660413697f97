"""Robot side with a driver process for the arm and one for objects: the examples of docs/drivers, on real sockets."""

import pytest

from common.errors import ConfigurationError
from common.roles import Role
from common.sockets.door.client import Door
from common.sockets.door.messages import DoorSettings
from robot_side.core.robot_side import RobotSide
from robot_side.drivers.mujoco.scene import Scene
from robot_side.drivers.remote.connected_drivers import ConnectedDrivers, driver_ports
from robot_side.parts import build_parts
from robot_side.settings import RobotSettings
from tests.helpers.socket_talk import EPHEMERAL
from tests.robot_side.drivers.remote.test_examples import running


def door(arm: str | None, objects: str | None) -> Door:
    return Door(DoorSettings(EPHEMERAL, EPHEMERAL, driver_ports(arm, objects)), print)


SETTINGS = RobotSettings(arm=EPHEMERAL, objects=EPHEMERAL, roles={"ball": Role.SUPPORT}, seed=1)


@pytest.mark.processes
def test_a_robot_side_waits_for_both_and_knows_no_truth(scene: Scene) -> None:
    notes: list[str] = []
    with door(SETTINGS.arm, SETTINGS.objects) as opened:
        opened.ready()
        drivers = ConnectedDrivers(opened, notes.append)
        parts = build_parts(SETTINGS, 1, "clock", scene, drivers=drivers)
        assert parts.notes[0].startswith("the driver's joints, in this order: shoulder_pan, shoulder_lift")
        arm_at, objects_at = (port.endpoint for port in drivers._ports.values())
        with running("example_arm.py", arm_at), running("example_objects.py", objects_at):
            meanwhile: list[int] = []
            drivers.wait(lambda: meanwhile.append(1))
            assert meanwhile  # The audit log is written while nobody drives yet.
            robot, port = RobotSide(parts), drivers._ports["--arm"]
            for _ in range(200):
                now_s = port.wait(0.001)
                robot.tick(now_s)
                robot.observe(now_s)
    assert robot.newest is not None
    objects = robot.newest[1].objects
    assert dict(zip(objects.names, objects.roles, strict=True)) == {
        "table": Role.SUPPORT,
        "target": Role.TARGET,
        "ball": Role.SUPPORT,
    }
    assert [note for note in notes if note.startswith("waiting for")] == [
        f"waiting for an arm's driver at {arm_at}",
        f"waiting for a process that perceives objects at {objects_at}",
    ]
    summary = robot.summary()
    assert [summary["contacts"], summary["min_distance_mm"], summary["task"]["placing"]] == [None] * 3
    assert drivers.summary()["arm"].keys() == {"accepted"}
    # Measurements in the simulation hold for no other arm.
    assert any("has not been measured" in note for note in parts.notes)
    with pytest.raises(ConfigurationError, match="roles: there is no object 'ball'"):
        build_parts(RobotSettings(roles={"ball": Role.SUPPORT}, scene="wall"), 1, "clock")


@pytest.mark.processes
def test_an_address_that_is_taken_is_refused_and_none_stays_open() -> None:
    with door(EPHEMERAL, None) as first:
        first.ready()
        taken = first.ports["--arm"].endpoint
        with door(EPHEMERAL, taken) as second, pytest.raises(ConfigurationError, match="--objects: cannot bind"):
            second.ready()
    with door(taken, None) as third:
        third.ready()
