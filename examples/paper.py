"""Equations 1 to 12 of the paper in numbers; docs/paper.md says how each is printed, read and built.

Run: python examples/paper.py
"""

from itertools import product

import numpy as np

from feelahead import Episode, enlargement_distance
from robot_side.drivers.mujoco.camera import CameraError
from robot_side.drivers.mujoco.encoders import Encoder
from robot_side.enlargement.kinematic_error import position_covariance
from robot_side.overlap import sphere_box, sphere_tetrahedron

random = np.random.default_rng(0)

# Eq. 1-2: the camera's error of each object is drawn once, true minus perceived.
camera = CameraError(tuple(f"object {number}" for number in range(1000)), 0.002, 0.003, 0.0, seed=0)
errors_m = -camera.next_frame()
print(f"eq. 1-2   Cam_Err: mean {1e3 * errors_m.mean():.2f} mm, sd {1e3 * errors_m.std():.2f} mm")

# Eq. 3: a reading's error has noise and the step of 15 bits a revolution.
encoder = Encoder(sigma_rad=2e-4, seed=0)
print(f"eq. 3     Δθ: sd {1e3 * encoder.standard_deviation_rad():.3f} mrad, step/√12 included")

# Eq. 4: the gripper by direct kinematics.
episode = Episode(scene="wall", seed=0)
arm, kinematics = episode.parts.arm, episode.parts.kinematics
state = arm.state(0.0)
pose = kinematics.pose(state)
print(f"eq. 4     T_n: tool at {np.round(pose.tool_position_m, 3).tolist()} m, {len(pose.sphere_radii_m)} spheres")

# Eq. 5-7: the spread of the tool's position over readings, against Σ = J diag(σ_θ²) Jᵀ.
jacobian = pose.tool_jacobian[None, :3]
covariance = position_covariance(jacobian, np.full(arm.joint_count, encoder.standard_deviation_rad()))[0]
readings = [encoder.read(state.joint_positions_rad) - state.joint_positions_rad for _ in range(20_000)]
seen_mm = 1e3 * (jacobian[0] @ np.transpose(readings)).std(axis=1)
by_formula_mm = 1e3 * np.sqrt(np.diag(covariance))
print(f"eq. 5-7   σ_p: {by_formula_mm.round(3)} mm, of 20 000 readings {seen_mm.round(3)} mm")

# Eq. 8: the way that the tool goes within the delay.
speed_m_s, delay_s = 0.2, 0.1
print(f"eq. 8     ΔT_d = v t_d: {1e3 * speed_m_s * delay_s:.0f} mm at {speed_m_s} m/s and {1e3 * delay_s:.0f} ms")

# Eq. 9-10: D_incr against P and t_d, with σ_c = 3 mm.
variance_m2 = float(np.trace(covariance)) + 0.003**2
delays_s = (0.0, 0.05, 0.1, 0.2, 0.4)
print("eq. 9-10  D_incr in mm at 0.2 m/s:  t_d  " + "  ".join(f"{1e3 * t_d:4.0f} ms" for t_d in delays_s))
for probability in (0.5, 0.9, 0.99, 0.999):
    row = [enlargement_distance(probability, 0.0, variance_m2, speed_m_s * t_d) for t_d in delays_s]
    print(f"{'P = ' + str(probability):>39}  " + "  ".join(f"{1e3 * distance_m:7.1f}" for distance_m in row))

# Eq. 11: a sphere and a tetrahedron, against points that are thrown into the sphere.
center, radius, corners = np.array([0.2, 0.1, 0.1]), 0.5, np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
points = random.uniform(-radius, radius, (400_000, 3)) + center
inside = (np.linalg.norm(points - center, axis=1) < radius) & (points > 0).all(axis=1) & (points.sum(axis=1) < 1)
exact = sphere_tetrahedron(center, radius, corners)
print(f"eq. 11    sphere and tetrahedron: {exact:.4f}, by 400 000 points {inside.mean() * (2 * radius) ** 3:.4f}")

# Eq. 12: V_s - Σ V_c + Σ V_w - Σ V_co. Cap, wedge and cone: what lies beyond one, two and three of the box's faces.
half, whole = np.array([0.3, 0.4, 0.2]), 0.0
for sides in product((-1, 0, 1), repeat=3):
    beyond = np.array(sides) * (half + 5.0), np.eye(3), np.where(np.array(sides) == 0, 10.0, 5.0)
    whole += (-1) ** np.count_nonzero(sides) * sphere_box(center[None], np.array([radius]), *(x[None] for x in beyond))[
        0
    ]
exact = sphere_box(center[None], np.array([radius]), np.zeros((1, 3)), np.eye(3)[None], half[None])[0]
print(f"eq. 12    sphere and box: {exact:.6f}, V_s - ΣV_c + ΣV_w - ΣV_co = {whole:.6f}")
