"""Draw the built-in scenes from above and from the side, before anything moves.

python -m feelahead.lab.scene_pictures --out docs/scenes
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, get_args

import numpy as np
import tyro
from msgspec import Meta

from common.command.command_line import parse_settings
from common.limits import check_limits
from feelahead.printing.pictures import figure
from robot_side.drivers.mujoco.built_in_scenes import SceneName
from robot_side.drivers.mujoco.hand.gripper_cover import placed_corners
from robot_side.drivers.mujoco.scene import load_scene

_GRASP_M: Final = 0.02
_GREY: Final = (0.25, 0.27, 0.30)


@dataclass(frozen=True)
class ScenePictures:
    """Draw the built-in scenes, with the gripper at its start, and faintly where it will grasp the target."""

    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path()
    """Existing folder for the pictures, one PNG for each scene."""
    seed: Annotated[int, Meta(ge=0), tyro.conf.arg(metavar="N")] = 0
    """Seed from which wall, posts and shelf are drawn."""

    def __post_init__(self) -> None:
        check_limits(self)
        if not self.out.is_dir():
            raise ValueError(f"--out {self.out}: the folder does not exist; valid: an existing folder")


def draw_scene(path: Path, name: SceneName, seed: int) -> None:
    """Draw the scene `name` from above and from the side, and write the picture to `path`."""
    from matplotlib.collections import PolyCollection  # noqa: PLC0415  # only pictures need it

    scene = load_scene(name=name, seed=seed)
    model, data = scene.model, scene.data
    target = next(thing for thing in scene.objects if thing.name == "target").geoms[0]
    to_grasp_m = data.geom_xpos[target] - data.site_xpos[scene.robot.site] + np.array([_GRASP_M, 0.0, 0.0])
    geoms = [geom for thing in scene.objects for geom in thing.geoms]
    drawn = [(placed_corners(model, data, np.array([geom])), tuple(model.geom_rgba[geom])) for geom in geoms]
    gripper = placed_corners(model, data, scene.robot.gripper_geoms)
    drawn = [(corners, colour) for corners, colour in drawn if len(corners)] + [(gripper, (*_GREY, 1.0))]
    with figure(path, 1, 2, f"{name}, seed {seed}", figsize=(9, 4), dpi=80) as (_, panels):
        for ax, view, up, towards in zip(panels, ("from above", "from the side"), (1, 2), (1.0, -1.0), strict=True):
            # Faces nearer to the viewer hide those behind.
            nearest = sorted(drawn, key=lambda one: float((towards * one[0][:, :, 3 - up]).max()))
            for corners, colour in (*nearest, (gripper + to_grasp_m, (*_GREY, 0.15))):
                ax.add_collection(PolyCollection(list(corners[:, :, [0, up]]), facecolor=colour))
            ax.set(title=view, xlabel="ahead, m", ylabel="to the left, m" if up == 1 else "up, m", aspect="equal")
            ax.set(xlim=(0.35, 1.1), ylim=(-0.3, 0.3) if up == 1 else (-0.05, 0.4))


if __name__ == "__main__":
    asked = parse_settings(ScenePictures, "python -m feelahead.lab.scene_pictures", sys.argv[1:])
    for scene_name in get_args(SceneName):
        draw_scene(asked.out / f"{scene_name}.png", scene_name, asked.seed)
