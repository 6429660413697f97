"""Draw figures 1 to 5 of the paper anew, from this system.

python -m feelahead.lab.paper_figures --out docs/paper --only 2 3
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
import tyro

from common.command.command_line import parse_settings, run_command
from common.errors import ConfigurationError
from common.protocol.view_messages import VIEW_NAMES
from common.roles import Role
from feelahead.both_sides.against_distance import draw_courses, strength_against_distance
from feelahead.both_sides.episode import Episode
from feelahead.printing.pictures import figure
from feelahead.printing.progress import progress
from robot_side.drivers.mujoco.hand.gripper_cover import placed_corners
from robot_side.overlap import sphere_box

PROGRAM: Final = "python -m feelahead.lab.paper_figures"
_LINK: Final = "delay 100ms"
_APPROACHES_S: Final = 1.8
"""Time after which a finger of 2 N has brought the gripper near the wall, and still moves it"""
_BLUE, _ORANGE, _GREY = "#0072b2", "#d55e00", "#777777"


@dataclass(frozen=True)
class PaperFigures:
    """Draw the paper's figures from this system, as FOLDER/fig1.png to fig5.png."""

    out: Annotated[Path, tyro.conf.arg(metavar="FOLDER")] = Path("paper-figures")
    """Folder for the pictures; it is made if it is missing."""
    only: Annotated[tuple[Literal[1, 2, 3, 4, 5], ...], tyro.conf.arg(metavar="N...")] = (1, 2, 3, 4, 5)
    """Numbers of the figures to draw."""


def _before_the_wall() -> Episode:
    """Return both sides while the gripper approaches the wall."""
    return Episode(scene="wall", link=_LINK, seed=3, law="paper").arm().step(_APPROACHES_S, r2_n=2.0)


def fig1(path: Path) -> None:
    """Draw the simulation of the robot and its surroundings."""
    with figure(path, figsize=(6.4, 4.8)) as (_, axes), Episode(scene="table", seed=0) as episode:
        axes.imshow(episode.picture("overview"))
        axes.set_axis_off()


def fig2(path: Path) -> None:
    """Draw the gripper's spheres, enlarged by D_incr, and what they overlap, from above."""
    from matplotlib.collections import PatchCollection, PolyCollection  # noqa: PLC0415  # only pictures need it
    from matplotlib.patches import Circle  # noqa: PLC0415

    episode = _before_the_wall()
    model, data = episode.scene.model, episode.scene.data
    pose = episode.parts.kinematics.pose(episode.parts.arm.state(episode.time_s))
    by_m = float(episode.history.enlargement_m[-1])
    title = f"spheres of the gripper, enlarged by D_incr = {1e3 * by_m:.0f} mm, from above"
    with figure(path, title=title, figsize=(7.2, 4.6)) as (_, axes):
        for thing in episode.scene.objects:
            if episode.scene.roles[thing.name] is Role.SUPPORT:
                continue
            corners = placed_corners(model, data, np.array(thing.geoms))
            axes.add_collection(PolyCollection(list(corners[:, :, :2]), facecolor=_ORANGE, alpha=0.35))
        for grown_m, colour, alpha in ((by_m, _BLUE, 0.05), (0.0, _GREY, 0.6)):
            circles = zip(pose.sphere_centers_m, pose.sphere_radii_m + grown_m, strict=True)
            drawn = [Circle(center[:2], radius) for center, radius in circles]
            axes.add_collection(PatchCollection(drawn, facecolor=colour, alpha=alpha))
        x, y = pose.tool_position_m[:2]
        axes.set(xlim=(x - 0.2, x + 0.25), ylim=(y - 0.16, y + 0.16), aspect="equal")
        axes.set(xlabel="ahead, m", ylabel="to the left, m")


def parts_of_eq_12() -> tuple[float, tuple[float, float, float, float]]:
    """Return the overlap of a sphere and a box, and V_s, ΣV_c, ΣV_w and ΣV_co of eq. 12, in units of R³.

    A cap lies beyond one face of the box, a wedge beyond two, a cone beyond three: the overlaps with large boxes there.
    """
    center, half, sums = np.array([[0.55, 0.45, 0.5]]), np.full((1, 3), 1.0), [0.0] * 4
    for sides in product((-1, 0, 1), repeat=3):
        there = np.array([sides]) * (half + 10.0), np.eye(3)[None], np.where(np.array([sides]) == 0, 20.0, 10.0)
        sums[int(np.count_nonzero(sides))] += float(sphere_box(center, np.ones(1), *there)[0])
    whole = float(sphere_box(center, np.ones(1), np.zeros((1, 3)), np.eye(3)[None], half)[0])
    return whole, (sums[0], sums[1], sums[2], sums[3])


def fig3(path: Path) -> None:
    """Draw a sphere at a box's corner, with the caps and the wedge that eq. 12 subtracts and adds, in section."""
    from matplotlib.patches import Circle, Rectangle  # noqa: PLC0415

    whole, (sphere, caps, wedges, cones) = parts_of_eq_12()
    words = f"V = V_s - ΣV_c + ΣV_w - ΣV_co = {sphere:.3f} - {caps:.3f} + {wedges:.3f} - {cones:.3f} = {whole:.3f} R³"
    with figure(path, title=words, figsize=(5.4, 5.0)) as (_, axes):
        axes.add_patch(Rectangle((-1.0, -1.0), 2.0, 2.0, facecolor=_GREY, alpha=0.25))
        ball = axes.add_patch(Circle((0.55, 0.45), 1.0, facecolor=_BLUE, alpha=0.25))
        for low in ((1.0, -2.0), (-2.0, 1.0)):
            beyond = axes.add_patch(Rectangle(low, 4.0, 4.0, facecolor=_ORANGE, alpha=0.4))
            beyond.set_clip_path(ball)
        for x, y, text in ((1.22, 0.2, "cap"), (0.3, 1.15, "cap"), (1.05, 1.06, "wedge"), (0.1, 0.1, "overlap")):
            axes.text(x, y, text)
        axes.set(xlim=(-1.2, 1.8), ylim=(-1.2, 1.7), aspect="equal", xlabel="x / R", ylabel="y / R")


def fig4(path: Path) -> None:
    """Draw the strength that the finger meets against the distance to the wall."""
    found = []
    for law in ("paper", "swept"):
        found += strength_against_distance(law, (0.06, 0.24), loop_age_s=0.1, scene="wall", seed=3)
    draw_courses({"wall": found}, path)


def fig5(path: Path) -> None:
    """Draw the two views that the operator gets: from above, and in the first person."""
    with figure(path, 1, 2, figsize=(9.6, 3.8)) as (_, panels), _before_the_wall() as episode:
        for axes, view in zip(panels, VIEW_NAMES, strict=True):
            axes.imshow(episode.picture(view))
            axes.set_axis_off()


FIGURES: Final[dict[int, Callable[[Path], Any]]] = {1: fig1, 2: fig2, 3: fig3, 4: fig4, 5: fig5}


def main(arguments: Sequence[str]) -> int:
    """Draw the figures that are asked for."""
    asked = parse_settings(PaperFigures, PROGRAM, arguments)
    try:
        asked.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigurationError(f"--out {asked.out}: {error.strerror}; valid: a folder that can be made") from error
    with progress("figures of the paper", float(len(asked.only))) as shown:
        for number in asked.only:
            shown.begin(f"figure {number}")
            FIGURES[number](asked.out / f"fig{number}.png")
            shown.advance(1.0)
    sys.stdout.write(f"{asked.out}\n")
    return 0


if __name__ == "__main__":
    run_command(PROGRAM, main)
