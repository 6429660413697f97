"""The pipeline's kernels: all ready before the first tick."""

import numpy as np
import pytest

from robot_side.assembly import build_robot_side
from robot_side.compiled.kernel import Compiled, imported_kernels
from robot_side.compiled.warm_up import warm_up
from robot_side.pairs.candidates import candidate_pairs
from robot_side.settings import EnlargementOptions, RobotSettings
from tests.helpers.perceived_scenes import random_scene


def test_warm_up_prepares_the_kernels_of_the_whole_pipeline() -> None:
    warm_up()
    assert all(kernel.ready for kernel in imported_kernels())
    modules = {kernel.name.rpartition(".")[0] for kernel in imported_kernels()}
    assert {
        "robot_side.stiffness.alignment",
        "robot_side.gripper.between_fingers",
        "robot_side.stiffness.predicted_contact",
        "robot_side.enlargement.distance",
        "robot_side.enlargement.kinematic_error",
        "robot_side.pairs.nearest_kernels",
        "robot_side.stiffness.object_shares",
        "robot_side.overlap.kernels",
        "robot_side.pairs.candidates",
        "robot_side.stiffness.reference_volume",
        "robot_side.arm.resolved_rate",
        "robot_side.stiffness.map",
        "robot_side.pairs.touching",
        "robot_side.objects.validity",
    } <= modules


@pytest.mark.parametrize("direction", ["isotropic", "towards_object"])
def test_nothing_is_compiled_within_a_tick(direction: str, monkeypatch: pytest.MonkeyPatch) -> None:
    warm_up()

    def late(kernel: Compiled) -> None:
        raise AssertionError(f"{kernel.name} was not ready")

    options = EnlargementOptions(direction=direction)  # type: ignore[arg-type]
    robot = build_robot_side(RobotSettings(enlargement=options), 1, "clock")
    monkeypatch.setattr(Compiled, "prepare", late)
    for tick in range(20):
        robot.tick(0.001 * tick)


def test_more_pairs_than_there_is_room_for_at_first_are_found_all_the_same() -> None:
    rng = np.random.default_rng(2)
    objects = random_scene(rng, 20, 0.2)
    centers, radii = rng.uniform(-0.2, 0.2, (30, 3)), np.full(30, 0.3)
    pairs = candidate_pairs(centers, radii, objects)
    assert len(pairs) > 1000
    one_by_one = [candidate_pairs(centers[row : row + 1], radii[row : row + 1], objects) for row in range(30)]
    assert len(pairs) == sum(len(found) for found in one_by_one)
    for row, found in enumerate(one_by_one):
        for part in ("spheres", "boxes", "tetrahedra", "half_spaces"):
            of_sphere = pairs.sphere_index[getattr(pairs, part)] == row
            expected = found.primitive_index[getattr(found, part)]
            np.testing.assert_array_equal(pairs.primitive_index[getattr(pairs, part)][of_sphere], expected)
