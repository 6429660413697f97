"""Hands in MJCF on an arm of one joint, which tests write to files and load as other people's models."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

_ARM = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.002" integrator="implicitfast" cone="elliptic" impratio="10" gravity="{gravity}"/>
  <default>
    <geom friction="1 0.01 0.001"/>
    <default class="slide"><joint type="slide" axis="1 0 0" range="0 0.03" damping="5" armature="0.1"/></default>
    <default class="turn"><joint axis="0 1 0" range="0 0.8" damping="0.2" armature="0.01"/></default>
  </default>
  <asset>
    <mesh name="pad" vertex="-.005 -.01 -.02 .005 -.01 -.02 -.005 .01 -.02 .005 .01 -.02
                             -.005 -.01 .02 .005 -.01 .02 -.005 .01 .02 .005 .01 .02"/>
  </asset>
  <worldbody>
    <geom name="far" type="sphere" size="0.02" pos="2 2 2"/>
    {post}
    <body name="hand">
      <joint name="wrist" axis="0 0 1" range="-1 1" damping="1" armature="1"/>
      <geom name="palm" type="box" size="0.06 0.03 0.01" mass="1"/>
      <site name="tool" pos="0 0 {tool_m}"/>
      {jaws}
    </body>
  </worldbody>
  <contact>
    <exclude body1="hand" body2="left"/>
    {excluded}
  </contact>
  <actuator><position name="wrist" joint="wrist" kp="1000" kv="100"/>{actuators}</actuator>
  {below}
</mujoco>
"""
APART: Final = '<exclude body1="hand" body2="right"/><exclude body1="left" body2="right"/>'
COUPLED: Final = '<equality><joint joint1="left" joint2="right" solref="0.005 1"/></equality>'
SLIDING: Final = """
  <body name="left"><joint name="left" class="slide"/>
    <geom type="box" pos="0.005 0 0.09" size="0.005 0.01 0.02" mass="0.05"/></body>
  <body name="right"><joint name="right" class="slide" axis="-1 0 0"/>
    <geom type="box" pos="-0.005 0 0.09" size="0.005 0.01 0.02" mass="0.05"/></body>
"""


def servo(inputs: str = "0 0.03", joint: str = "left", **changed: str) -> str:
    """Return a position servo of the fingers' `joint` that takes `inputs`; changed: its other attributes."""
    attributes = {"kp": "1000", "kv": "20", "forcerange": "-40 40"} | changed
    said = " ".join(f'{name}="{value}"' for name, value in attributes.items())
    return f'<position name="{joint}" joint="{joint}" ctrlrange="{inputs}" {said}/>'


def motor(changed: str = "") -> str:
    """Return a motor of the left finger of 40 N, either way; changed: its other attributes."""
    return f'<general joint="left" gainprm="40" ctrlrange="-1 1" {changed}/>'


@dataclass(frozen=True)
class Hand:
    """Hand whose tool points up, and whose jaws close along x; unless given, two jaws slide, with a gap of 60 mm."""

    jaws: str = SLIDING
    actuators: str = servo()
    excluded: str = APART
    """Pairs of bodies that do not touch"""
    below: str = COUPLED
    tool_m: float = 0.09
    """Height of the tool's site above the palm; the fingers end at 0.11 m"""
    gravity: str = "0 0 -9.81"
    post_at_m: float = 0.0
    """Place of the post along x"""

    def written(self, path: Path, post_m: float = 0.0) -> Path:
        """Write the model to a file in `path`; post_m: thickness of a post that is fixed between the jaws."""
        post = (
            f'<geom name="post" type="box" pos="{self.post_at_m} 0 0.1" size="{0.5 * post_m} 0.006 0.006"/>'
            if post_m
            else ""
        )
        file = path / f"hand_{1e3 * post_m:.0f}.xml"
        file.write_text(_ARM.format(post=post, **vars(self)))
        return file
