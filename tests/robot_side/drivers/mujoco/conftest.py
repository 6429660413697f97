from pathlib import Path

import pytest

from robot_side.drivers.mujoco.scene import Scene, load_scene
from tests.helpers.arm_models import SHAPES, STONE, planar_arm


@pytest.fixture
def built_in() -> Scene:
    return load_scene()


@pytest.fixture
def shapes(tmp_path: Path) -> Scene:
    return load_scene(planar_arm(tmp_path, world=SHAPES, extra_top=STONE), "tcp")
