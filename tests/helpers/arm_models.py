"""Small robot arms in MJCF, unlike the built-in arm, which tests write to files and load as a user's own model."""

import re
from pathlib import Path

# A planar arm whose gripper is like a Franka hand's: one tendon over both fingers, and a high input opens it.
PLANAR_ARM = """
<mujoco model="planar">
  <option timestep="0.002" integrator="implicitfast"/>
  {extra_top}
  <worldbody>
    {world}
    <body name="base" pos="{base}" euler="0 0 {yaw_deg}">
      <geom name="base" type="cylinder" size="0.05 0.05" contype="0" conaffinity="0"/>
      <body name="upper" pos="0 0 0.3">
        <joint name="shoulder" axis="0 1 0" range="-170 170" damping="1" armature="0.1"/>
        <geom name="upper" type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="2"/>
        <body name="lower" pos="0.3 0 0">
          <joint name="elbow" axis="0 1 0" range="-160 -10" damping="1" armature="0.1"/>
          <geom name="lower" type="capsule" fromto="0 0 0 0.25 0 0" size="0.025" mass="1"/>
          {wrist}
          <body name="hand" pos="0.3 0 0" quat="0.70710678 0 0.70710678 0">
            <geom name="palm" type="box" size="0.02 0.06 0.02" mass="0.3"/>
            <site name="tcp" pos="0 0 0.08"/>
            <site name="camera_mount"/>
            <body name="left" pos="0 0 0.03">
              <joint name="left" type="slide" axis="0 1 0" range="0 0.04" damping="10"/>
              <geom name="left_tip" type="box" pos="0 0.01 0.03" size="0.01 0.01 0.03" mass="0.02"/>
            </body>
            <body name="right" pos="0 0 0.03">
              <joint name="right" type="slide" axis="0 {right_axis} 0" range="{right_range}" damping="10"/>
              <geom name="right_tip" type="box" pos="0 -0.01 0.03" size="0.01 0.01 0.03" mass="0.02"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <contact>
    <exclude body1="hand" body2="left"/><exclude body1="hand" body2="right"/><exclude body1="base" body2="upper"/>
  </contact>
  <tendon><fixed name="split"><joint joint="left" coef="0.5"/><joint joint="right" coef="0.5"/></fixed></tendon>
  <actuator>{arm_actuators}{gripper_actuators}</actuator>
  {extra_bottom}
</mujoco>
"""
POSITION_SERVOS = (
    '<position name="shoulder" joint="shoulder" kp="2000" kv="100"/>'
    '<position name="elbow" joint="elbow" kp="1000" kv="50"/>'
)
VELOCITY_SERVOS = '<velocity name="shoulder" joint="shoulder" kv="200"/><velocity name="elbow" joint="elbow" kv="100"/>'
MOTORS = '<motor name="shoulder" joint="shoulder" gear="50"/><motor name="elbow" joint="elbow"/>'
# Several actuators on each joint: servos of position and velocity, also with small inputs and no force limit; servos
# and motors, of which neither could do all; two servos; MuJoCo's own for two inputs; and a spring beside a motor.
SEVERAL = [
    POSITION_SERVOS + VELOCITY_SERVOS,
    VELOCITY_SERVOS.replace("kv", 'ctrlrange="-0.1 0.1" kv') + POSITION_SERVOS.replace('kv="50"', 'kv="0"'),
    POSITION_SERVOS.replace("kp", 'forcerange="-25 25" kp') + MOTORS.replace("joint=", 'ctrlrange="-10 10" joint='),
    POSITION_SERVOS + POSITION_SERVOS.replace("kp", 'gear="-2" kp'),
    VELOCITY_SERVOS + MOTORS,
    "".join(f'<pid name="{joint}" joint="{joint}" kp="800" kv="40"/>' for joint in ("shoulder", "elbow")),
    "".join(
        f'<general joint="{joint}" biastype="affine" biasprm="1 -20 -1" gainprm="0"/>'
        for joint in ("shoulder", "elbow")
    )
    + MOTORS,
]
SEVERAL = [re.sub('name="[a-z]+" joint', "joint", actuators) for actuators in SEVERAL]
# As in the Franka hand of MuJoCo's own collection of models: 0 is closed, 255 is open.
TENDON_GRIPPER = (
    '<general name="hand" tendon="split" forcerange="-100 100" ctrlrange="0 255" biastype="affine"'
    ' gainprm="0.0156863 0 0" biasprm="0 -100 -10"/>'
)
# Two opposed servos: the right finger's joint opens towards negative values.
MIRRORED_GRIPPER = (
    '<position name="left" joint="left" kp="500" kv="20" ctrlrange="0 0.04"/>'
    '<position name="right" joint="right" kp="500" kv="20" ctrlrange="-0.04 0"/>'
)
COUPLING = '<equality><joint joint1="left" joint2="right"/></equality>'

# Objects of every shape for the planar arm, two in trees of bodies and one that is only visible.
SHAPES = """
  <body name="post" pos="0.9 0.3 0.2" euler="20 30 40">
    <geom name="cylinder" type="cylinder" size="0.05 0.1"/>
    <geom name="capsule" type="capsule" pos="0 0 0.15" euler="50 0 10" size="0.03 0.05"/>
    <body name="lamp" pos="0.1 0 0"><joint name="hinge"/><geom name="lamp" type="sphere" size="0.04"/></body>
  </body>
  <body name="Target_egg" pos="1 0 0.3" euler="10 20 30">
    <freejoint/><geom name="egg" type="ellipsoid" size="0.03 0.04 0.06"/>
  </body>
  <geom name="wall" type="plane" pos="1.5 0 0" zaxis="-1 0 0.2" size="1 1 0.1"/>
  <geom name="table_slab" type="box" pos="0.8 -0.4 0.1" euler="0 0 30" size="0.1 0.2 0.1"/>
  <geom type="sphere" pos="0.7 0.5 0.9" size="0.05"/>
  <geom name="picture" type="box" pos="0 1 1" size="0.1 0.1 0.1" contype="0" conaffinity="0"/>
  <body name="stone" pos="1 -0.3 0.4" euler="5 10 15"><geom name="stone" type="mesh" mesh="stone"/></body>
"""
STONE = '<asset><mesh name="stone" vertex="0 0 0.1  0.07 0 0  -0.035 0.06 0  -0.035 -0.06 0.01"/></asset>'


def planar_arm(
    path: Path,
    arm_actuators: str = POSITION_SERVOS,
    gripper_actuators: str = TENDON_GRIPPER,
    world: str = "",
    wrist: str = "",
    base: str = "0 0 0",
    yaw_deg: float = 0.0,
    extra_top: str = "",
    extra_bottom: str = COUPLING,
    mirrored: bool = False,
) -> Path:
    """Write the MJCF of a planar arm with two joints to `path`/arm.xml, with these parts, and return that file."""
    file = path / "arm.xml"
    file.write_text(
        PLANAR_ARM.format(
            arm_actuators=arm_actuators,
            gripper_actuators=gripper_actuators,
            world=world,
            wrist=wrist,
            base=base,
            yaw_deg=yaw_deg,
            extra_top=extra_top,
            extra_bottom=extra_bottom,
            right_axis=1 if mirrored else -1,
            right_range="-0.04 0" if mirrored else "0 0.04",
        )
    )
    return file
