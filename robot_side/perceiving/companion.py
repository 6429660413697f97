"""Process that takes depth pictures, started by `Surfaced`: `python -m robot_side.perceiving.companion FD`.

It maps them, and sends the surfaces that have changed.
"""

import select
import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from common.clock import MonotonicClock
from common.companion.channel import Channel
from common.companion.process import companion_channel
from common.errors import FeelaheadError
from common.realtime.priority import lower_priority
from common.sockets.door.client import Door
from robot_side.compiled.kernel import imported_kernels
from robot_side.compiled.warm_up import warm_up
from robot_side.depth.camera_settings import DEPTH_PORT
from robot_side.depth.perception import DepthPerception
from robot_side.depth.sensors import SENSORS
from robot_side.drivers.mujoco.depth_cameras.posed_robot import PosedRobot, RobotParts
from robot_side.drivers.mujoco.depth_cameras.rig import DepthRig
from robot_side.drivers.mujoco.drawing.off_screen import REMEDY
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.drivers.mujoco.scene import Scene, load_scene
from robot_side.drivers.remote.depth import RemoteDepth
from robot_side.perceiving.exchange import (
    Forget,
    Joints,
    Note,
    Ready,
    Refusal,
    RoleOf,
    Setup,
    decode_to_companion,
    encode,
    surfaces,
)
from robot_side.perceiving.taking import SentPictures, SimulatedPictures, Taking

_NICENESS: Final = -5
"""Above ordinary programs, as what is felt waits for it; below the sides"""
_WAIT_S: Final = 0.02
_LONGEST_REASON: Final = 300
_KERNELS: Final = "robot_side.depth."


def main() -> None:
    """Serve until the robot side's process has ended."""
    channel, _ = companion_channel(sys.argv[1:])
    lower_priority(_NICENESS)
    while not channel.ended and not (first := channel.receive()):
        select.select([channel], [], [])
    if channel.ended:
        return
    setup = decode_to_companion(first[0])
    if isinstance(setup, Setup):
        with ExitStack() as stack:
            try:
                taking, wait = _prepared(setup, channel, stack)
            except Exception as error:  # the graphics library's are of many kinds
                _refuse(channel, setup, error)
                return
            _serve(channel, taking, wait, first[1:])


def _prepared(setup: Setup, channel: Channel, stack: ExitStack) -> tuple[Taking, Callable[[float], object]]:
    """Return the source of news, and the wait for it; then all is compiled, and the port is bound."""
    of = setup.scene
    model = None if of.model is None else Path(of.model)
    scene: Scene = load_scene(model, of.site, of.roles, of.name, of.seed, of.site_axis)  # type: ignore[arg-type]
    taking: Taking
    endpoint = ""

    def on_channel(timeout_s: float) -> object:
        return select.select([channel], [channel] if channel.waiting else [], [], timeout_s)

    wait: Callable[[float], object] = on_channel
    if setup.port is None:
        rig = DepthRig(scene, setup.camera, setup.mapped, Encoder(*setup.encoder, setup.seed), setup.seed)
        stack.callback(rig.close)
        taking = SimulatedPictures(scene, rig)
    else:

        def note(text: str) -> None:
            channel.send(encode(Note(text)))

        door = stack.enter_context(Door(setup.port, note))
        remote = RemoteDepth(door.ports[DEPTH_PORT], note)
        robot = PosedRobot(scene.model, RobotParts.of(scene.robot), scene.data.qpos)
        robot.require_links(mount.link for mount in setup.mounts.values())
        errors = SENSORS[setup.camera.sensor].depth_errors(setup.camera.noise)
        taking = SentPictures(remote, robot, setup.mounts, lambda: DepthPerception(setup.mapped), errors)
        wait = door.wait
        door.ready()
        endpoint = door.ports[DEPTH_PORT].endpoint
    warm_up(kernels=[kernel for kernel in imported_kernels() if kernel.name.startswith(_KERNELS)])
    channel.send(encode(Ready(endpoint)))
    return taking, wait


def _refuse(channel: Channel, setup: Setup, error: Exception) -> None:
    reason = (str(error).strip().splitlines() or [type(error).__name__])[0][:_LONGEST_REASON]
    if setup.port is None and not isinstance(error, FeelaheadError):
        reason = f"no depth can be rendered here: {reason}; to mend it: {REMEDY}"
    channel.send(encode(Refusal(reason)))
    while channel.waiting and not channel.ended:
        select.select([], [channel], [])
        channel.flush()


def _serve(channel: Channel, taking: Taking, wait: Callable[[float], object], waiting: list[bytes]) -> None:
    clock, all_sent = MonotonicClock(), True
    while not channel.ended:
        for payload in (*waiting, *channel.receive()):
            message = decode_to_companion(payload)
            if isinstance(message, Joints):
                taking.hear(message)
            elif isinstance(message, RoleOf):
                taking.set_role(message.name, message.role)
            elif isinstance(message, Forget):
                taking.forget()
                all_sent = False
        waiting = []
        news = taking.step(clock.now())
        if news is not None:
            # What has not been sent is lost, and all is sent instead.
            changes = news.changes if all_sent else taking.perception.whole()
            told = taking.perception.newest(), taking.unknown()
            all_sent = channel.send(encode(surfaces(changes, news.taken_s, *told)))
        wait(_WAIT_S)


if __name__ == "__main__":
    main()
