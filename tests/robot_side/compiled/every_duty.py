"""Everything that a robot side may have to do, in a process of its own that compiles nothing after it has begun."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from common.protocol.codec import encode
from common.protocol.messages import Mark, Tune
from common.roles import Role
from robot_side.compiled.kernel import late_kernels
from robot_side.compiled.warm_up import warm_up
from robot_side.drivers.mujoco.scene import load_scene
from robot_side.drivers.remote.frame_build import perceived
from robot_side.drivers.remote.frame_message import SHAPES, SeenObject, SentMesh
from robot_side.drivers.remote.sent_meshes import SentMeshes
from robot_side.drivers.remote.sent_meshes import prepared as prepared_mesh
from robot_side.laws.named import LAWS
from robot_side.parts import SceneParts, build_parts
from robot_side.surroundings.perceived import PerceivedObjects
from tests.helpers.repository import DATA
from tests.robot_side.session_bench import QUICK, Bench, Operator


@contextmanager
def prepared(law: str, model: Path | None = None, *, any_objects: bool = False) -> Iterator[SceneParts]:
    """Yield a robot side's parts as a process makes them, with their kernels ready; any other kernel is an error."""
    # With a smaller f the paper's laws, which know no support, let nothing be set down.
    settings = replace(QUICK, law=law, law_paper_share=0.05, assist="speed", permit_tuning=True)
    # As the built-in scene: the checks of a person's own model run kernels, too.
    scene = None if model is None else load_scene(model, "tool")
    parts = replace(build_parts(settings, 1, "clock", scene), any_objects=any_objects)
    warm_up(kernels=parts.kernels)
    with late_kernels(refuse):
        yield parts


def refuse(kernel: str) -> None:
    raise AssertionError(f"{kernel} was not ready")


def explain(bench: Bench, parts: SceneParts) -> None:
    assert bench.robot.newest is not None
    sensed, situation = bench.robot.newest
    parts.explains.explain("l2", situation, sensed)
    parts.explains.explain("r2", situation, sensed)
    parts.enlarged.overlaps_m3("l2", situation)
    parts.enlarged.overlaps_m3("r2", situation)
    bench.robot.status(bench.now_s)


def tell(bench: Bench, operator: Operator, message: Mark | Tune) -> None:
    bench.robot.receive(operator.peer, encode(message), bench.now_s)


def set_down(law: str) -> None:
    """Grip, lift, lower to the table, let go, go home; then another operator drives, and the scene is put back."""
    with prepared(law, DATA / "place_held.xml") as parts:
        bench = Bench(parts=parts)
        owner, other = bench.join(2), bench.join(3, b"other")
        bench.arm_it(owner)
        bench.drive(1.0, owner, gripper=1.0)
        assert bench.robot.held == "target"
        explain(bench, parts)
        bench.drive(1.5, owner, gripper=1.0, r2=0.8)
        bench.drive(0.1, owner, gripper=1.0, l2=0.2)
        bench.drive(1.5, owner, gripper=1.0, r2=0.2)
        assert bench.robot.grip.touchdown.stands
        tell(bench, owner, Tune(owner.link.stamp(bench.now_s), 1, probability=0.9))
        bench.drive(0.5, owner, gripper=-1.0)
        assert bench.robot.held is None
        bench.drive(0.3, owner, lateral=(0.5, 0.0), turning=(0.0, 0.5), compensation="robot")
        bench.drive(0.3, owner, home=1.0)
        explain(bench, parts)
        bench.drive(0.1, owner, hand_over=True)
        assert bench.robot.session.owner_peer == other.peer
        bench.arm_it(other)
        bench.drive(0.3, other, r2=0.3, next_target=True)
        tell(bench, other, Mark(other.link.stamp(bench.now_s), 1, "reset"))
        bench.drive(0.3, other)
        bench.silence(0.5)
        assert bench.state == "disarmed"
        bench.robot.summary()


def approach_a_mesh(law: str) -> None:
    with prepared(law, DATA / "mug.xml") as parts:
        bench = Bench(parts=parts)
        bench.cruise(bench.join(2), 0.5)
        explain(bench, parts)


class Driver:
    """Driver whose frames show an object of another shape every 40 ms, in the gripper's way or around its fingers."""

    def __init__(self) -> None:
        corners = (0.0, 0.0, 0.0), (0.03, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.03)
        self._things = (
            SeenObject(name="thing", sphere=0.02),
            SeenObject(name="thing", box=(0.02, 0.02, 0.02)),
            SeenObject(name="thing", ellipsoid=(0.02, 0.03, 0.04)),
            SeenObject(name="thing", half_space=True),
            SeenObject(name="thing", tetrahedra=(corners,)),
            SeenObject(name="thing", mesh="wedge"),
        )
        wedge = prepared_mesh("wedge", SentMesh(corners, ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))))
        self._library = SentMeshes().and_also({"wedge": wedge}).library
        assert len(self._things) == len(SHAPES)
        self.place_m = np.zeros(3)

    def perceive(self, now_s: float) -> PerceivedObjects:
        thing, (x, y, z) = self._things[round(now_s / 0.04) % len(self._things)], self.place_m.tolist()
        shown = msgspec.structs.replace(thing, position_m=(x, y, z), velocity_m_s=(0.0, 0.01, 0.0))
        return perceived([shown], [Role.OBSTACLE], now_s, self._library)

    def set_role(self, name: str, role: Role) -> None:
        del name, role


def meet_all_shapes(law: str) -> None:
    with prepared(law, any_objects=True) as parts:
        driver = Driver()
        bench = Bench(parts=replace(parts, camera=driver))
        owner = bench.join(2)
        bench.arm_it(owner)
        for ahead_m in (0.05, 0.0):
            driver.place_m = bench.tool_m + np.array([ahead_m, 0.0, 0.0])
            bench.drive(0.25, owner, r2=0.2)
            explain(bench, parts)
        assert bench.robot.figures.summary()["overlap_mm3"]["max"] > 0.0


if __name__ == "__main__":
    [name] = [name for name in LAWS if name in sys.argv]
    for duty in (set_down, meet_all_shapes, approach_a_mesh):
        duty(name)
