from pathlib import Path

import mujoco  # type: ignore[import-untyped]
import numpy as np
import pytest

from common.arrays import FloatArray
from common.errors import ConfigurationError
from robot_side.simulation import kinematics
from robot_side.simulation.encoders import Encoder
from robot_side.simulation.kinematics import MujocoKinematics
from robot_side.simulation.scene import Scene, load_scene
from tests.helpers.tool_driver import PERIOD_S, ToolDriver


def test_kinematics_with_perfect_encoders_is_the_truth() -> None:
    driver = ToolDriver.load(encoder=Encoder(0.0, 0.0))
    driver.move(np.array([0.1, 0.1, -0.05, 0.2, 0.1, 0.3]), 0.4)
    state = driver.grip(1.0, 0.3)
    pose = driver.pose(state)
    data, site = driver.scene.data, driver.scene.robot.site
    # The encoders are read after the last step, the simulation's own kinematics stand before it.
    mujoco.mj_forward(driver.scene.model, data)
    np.testing.assert_allclose(pose.tool_position_m, data.site_xpos[site], atol=1e-12)
    np.testing.assert_allclose(pose.tool_rotation, data.site_xmat[site].reshape(3, 3), atol=1e-12)


def test_encoder_noise_moves_the_tool_as_the_propagated_error_says() -> None:
    driver = ToolDriver.load()
    encoder = Encoder(2e-3, 1e-3, seed=2)
    data, robot = driver.scene.data, driver.scene.robot
    true = data.qpos[robot.arm_positions].copy()
    state = driver.arm.state(driver.now_s)
    errors = []
    for _ in range(3000):
        reading = type(state)(**{**state.__dict__, "joint_positions_rad": encoder.read(true)})
        pose = driver.pose(reading)
        errors.append(pose.tool_position_m - data.site_xpos[robot.site])
    jacobian = pose.tool_jacobian[:3]
    predicted = encoder.standard_deviation_rad() ** 2 * jacobian @ jacobian.T
    # Whitened by what eq. 5 predicts, the errors have unit covariance; 3000 samples leave about 2.6 % (1 sigma).
    whitened = np.linalg.solve(np.linalg.cholesky(predicted), np.array(errors).T)
    np.testing.assert_allclose(np.cov(whitened), np.eye(3), atol=0.1)
    assert np.abs(whitened.mean(axis=1)).max() < 4.0 / np.sqrt(3000)


def test_the_arms_own_reading_is_within_the_predicted_error_of_the_truth() -> None:
    driver = ToolDriver.load()
    sigma_rad = Encoder().standard_deviation_rad()
    ratios = []
    for _ in range(200):
        pose = driver.pose(driver.wait(PERIOD_S))
        error = pose.tool_position_m - driver.tool_m()
        jacobian = pose.tool_jacobian[:3]
        ratios.append(float(error @ np.linalg.solve(sigma_rad**2 * jacobian @ jacobian.T, error)))
    # Chi-squared with three degrees of freedom: mean 3, and the mean of 200 within 4 of its deviations.
    assert np.mean(ratios) == pytest.approx(3.0, abs=4.0 * np.sqrt(6.0 / 200))


def test_jacobians_are_the_derivatives_of_the_spheres() -> None:
    driver = ToolDriver.load(encoder=Encoder(0.0, 0.0))
    state = driver.wait(PERIOD_S)
    pose = driver.pose(state)
    step = 1e-6
    for joint in range(6):
        poses = []
        for sign in (-1.0, 1.0):
            moved = state.joint_positions_rad.copy()
            moved[joint] += sign * step
            poses.append(driver.pose(type(state)(**{**state.__dict__, "joint_positions_rad": moved})))
        numeric = (poses[1].sphere_centers_m - poses[0].sphere_centers_m) / (2.0 * step)
        np.testing.assert_allclose(pose.sphere_jacobians[:, :, joint], numeric, atol=1e-8)
        tool = (poses[1].tool_position_m - poses[0].tool_position_m) / (2.0 * step)
        np.testing.assert_allclose(pose.tool_jacobian[:3, joint], tool, atol=1e-8)


def points_of(scene: Scene, geom: int, random: np.random.Generator) -> FloatArray:
    """Points (n, 3) of the box around a geom in the world: its corners, and others on its surface."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    on_surface = random.uniform(-1.0, 1.0, (2000, 3))
    axis = random.integers(3, size=2000)
    on_surface[np.arange(2000), axis] = np.sign(on_surface[np.arange(2000), axis])
    local = scene.model.geom_aabb[geom, :3] + np.vstack([signs, on_surface]) * scene.model.geom_aabb[geom, 3:]
    placed: FloatArray = scene.data.geom_xpos[geom] + local @ scene.data.geom_xmat[geom].reshape(3, 3).T
    return placed


@pytest.mark.parametrize("closing_s", [0.0, 0.3, 0.8])
def test_nothing_of_the_gripper_is_outside_its_spheres_wherever_its_fingers_are(closing_s: float) -> None:
    driver = ToolDriver.load(encoder=Encoder(0.0, 0.0))
    driver.move(np.array([0.05, 0.1, -0.05, 0.2, 0.1, 0.3]), 0.2)
    state = driver.grip(1.0, closing_s) if closing_s else driver.wait(PERIOD_S)
    scene = driver.scene
    mujoco.mj_forward(scene.model, scene.data)
    pose, random = driver.pose(state), np.random.default_rng(1)
    assert len(pose.sphere_radii_m) == 246
    for geom, on_finger in zip(scene.robot.gripper_geoms, scene.robot.geom_on_finger, strict=True):
        points = points_of(scene, int(geom), random)
        own = pose.sphere_on_finger == on_finger
        apart = np.linalg.norm(points[:, None] - pose.sphere_centers_m[own][None], axis=2)
        assert (apart <= pose.sphere_radii_m[own] + 1e-8).any(axis=1).all()


def test_no_sphere_stands_out_of_the_gripper_by_more_than_3_mm() -> None:
    driver = ToolDriver.load(encoder=Encoder(0.0, 0.0))
    state = driver.wait(PERIOD_S)
    scene = driver.scene
    mujoco.mj_forward(scene.model, scene.data)
    pose = driver.pose(state)
    depths = np.full(len(pose.sphere_radii_m), -np.inf)
    for geom in scene.robot.gripper_geoms:
        in_geom = pose.sphere_centers_m - scene.data.geom_xpos[geom]
        local = in_geom @ scene.data.geom_xmat[geom].reshape(3, 3) - scene.model.geom_aabb[geom, :3]
        depths = np.maximum(depths, (scene.model.geom_aabb[geom, 3:] - np.abs(local)).min(axis=1))
    assert (pose.sphere_radii_m - depths).max() <= 0.003 + 1e-8


@pytest.mark.parametrize("closing_s", [0.0, 0.3])
def test_the_gap_between_the_fingers_is_kept_free_but_for_3_mm_on_either_side(closing_s: float) -> None:
    driver = ToolDriver.load(encoder=Encoder(0.0, 0.0))
    state = driver.grip(1.0, closing_s) if closing_s else driver.wait(PERIOD_S)
    pose = driver.pose(state)
    fingers = pose.sphere_on_finger
    # They close along x of the tool.
    aside = (pose.sphere_centers_m[fingers] - pose.tool_position_m) @ pose.tool_rotation[:, 0]
    free_m = 2.0 * (np.abs(aside) - pose.sphere_radii_m[fingers]).min()
    assert free_m == pytest.approx(state.gripper_opening_m - 2 * 0.003, abs=5e-4)
    assert free_m > 0.03


def test_a_coarser_cover_has_fewer_spheres() -> None:
    driver = ToolDriver.load(encoder=Encoder(0.0, 0.0))
    state = driver.wait(PERIOD_S)
    counts = [
        len(MujocoKinematics(driver.scene, stand_out_m).pose(state).sphere_radii_m)
        for stand_out_m in (0.002, 0.003, 0.005, 0.01)
    ]
    assert counts == sorted(counts, reverse=True)
    assert counts[1] == 246
    assert counts[3] < 50


def test_the_order_by_nearness_only_permutes(monkeypatch: pytest.MonkeyPatch) -> None:
    driver = ToolDriver.load(encoder=Encoder(0.0, 0.0))
    state = driver.wait(PERIOD_S)
    ordered = MujocoKinematics(driver.scene).pose(state)
    monkeypatch.setattr(kinematics, "near_order", lambda centers_m, _: np.arange(len(centers_m)))
    as_covered = MujocoKinematics(driver.scene).pose(state)
    rows = [
        np.column_stack([pose.sphere_centers_m, pose.sphere_radii_m, pose.sphere_on_finger])
        for pose in (ordered, as_covered)
    ]
    assert (rows[0] != rows[1]).any()
    here, there = (values[np.lexsort(values.T)] for values in rows)
    np.testing.assert_array_equal(here, there)


def test_nothing_at_the_tool_is_told(tmp_path: Path) -> None:
    bare = """<mujoco><worldbody><body><joint name="j"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
      <site name="end"/></body><body name="box"><geom size="0.1"/></body></worldbody>
      <actuator><motor joint="j"/></actuator></mujoco>"""
    (tmp_path / "bare.xml").write_text(bare)
    with pytest.raises(ConfigurationError, match="nothing at the tool can touch"):
        MujocoKinematics(load_scene(tmp_path / "bare.xml", "end"))
