import pytest

from robot_side.drivers.mujoco.scene import Scene, load_scene


@pytest.fixture(scope="session")
def scene() -> Scene:
    return load_scene()
