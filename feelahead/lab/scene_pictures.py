"""Draw the built-in scenes from above and from the side, as they stand before anything moves.

python -m feelahead.lab.scene_pictures --out docs/scenes
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, get_args

import numpy as np
import tyro
from msgspec import Meta

from common.arrays import FloatArray
from common.command.command_line import parse_settings
from common.limits import check_limits
from feelahead.lab.figures import figure
from robot_side.simulation.built_in_scenes import SceneName
from robot_side.simulation.scene import Scene, load_scene

_GRASP_M: Final = 0.02
_VIEWS: Final = (("from above", 0, 1), ("from the side", 0, 2))
_FLOOR_M: Final = -0.1
"""Things below this height are not drawn."""


@dataclass(frozen=True)
class ScenePictures:
    """Draw the built-in scenes: the gripper at its start, and dashed where it grasps."""

    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path()
    """One PNG for each scene goes there."""
    seed: Annotated[int, Meta(ge=0), tyro.conf.arg(metavar="N")] = 0
    """The seed that draws wall, posts and shelf."""

    def __post_init__(self) -> None:
        check_limits(self)
        if not self.out.is_dir():
            raise ValueError(f"--out {self.out}: there is no such folder; valid: an existing folder")


def draw_scene(path: Path, name: SceneName, seed: int) -> None:
    """Write one scene's picture."""
    scene = load_scene(name=name, seed=seed)
    target = next(thing for thing in scene.objects if thing.name == "target").geoms[0]
    tool_m, target_m = scene.data.site_xpos[scene.robot.site], scene.data.geom_xpos[target]
    to_grasp_m: FloatArray = target_m - tool_m + np.array([_GRASP_M, 0.0, 0.0])
    with figure(path, 1, 2, f"{name}, seed {seed}", figsize=(9, 4), dpi=80) as (_, panels):
        for ax, (view, across, up) in zip(panels, _VIEWS, strict=True):
            for thing in scene.objects:
                for geom in thing.geoms:
                    colour = tuple(scene.model.geom_rgba[geom])
                    _outline(ax, scene, geom, (across, up), np.zeros(3), colour, "-")
            for geom in scene.robot.gripper_geoms:
                _outline(ax, scene, int(geom), (across, up), np.zeros(3), (0.25, 0.27, 0.30, 1.0), "-")
                _outline(ax, scene, int(geom), (across, up), to_grasp_m, None, "--")
            ax.set(title=view, xlabel="ahead, m", ylabel="to the left, m" if up == 1 else "up, m", aspect="equal")
            ax.set(xlim=(0.35, 1.1), ylim=(-0.3, 0.3) if up == 1 else (-0.05, 0.4))


def _outline(
    ax: Any,
    scene: Scene,
    geom: int,
    axes: tuple[int, int],
    shift_m: FloatArray,
    colour: tuple[float, ...] | None,
    style: str,
) -> None:
    """Outline a geom's bounding box, seen along the third axis."""
    from matplotlib.patches import Polygon  # noqa: PLC0415  # only pictures need it
    from scipy.spatial import ConvexHull  # noqa: PLC0415

    model, data = scene.model, scene.data
    center, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    corners = (center + signs * half) @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom] + shift_m
    if model.geom_rbound[geom] == 0.0 or corners[:, 2].max() < _FLOOR_M:
        return
    flat = corners[:, axes]
    hull = flat[ConvexHull(flat).vertices]
    # Higher things hide lower ones; an outline hides nothing.
    order = 2.0 + float(corners[:, 2].max()) if colour else 4.0
    face = colour or "none"
    ax.add_patch(Polygon(hull, facecolor=face, edgecolor="black", linestyle=style, linewidth=0.7, zorder=order))


def draw_scenes(arguments: Sequence[str]) -> int:
    """Draw them all."""
    settings = parse_settings(ScenePictures, "python -m feelahead.lab.scene_pictures", arguments)
    for name in get_args(SceneName):
        draw_scene(settings.out / f"{name}.png", name, settings.seed)
    return 0


if __name__ == "__main__":
    sys.exit(draw_scenes(sys.argv[1:]))
