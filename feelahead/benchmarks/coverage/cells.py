"""What is varied: motion and link (recorded), scene, camera and encoders (drawn afterwards)."""

from dataclasses import dataclass
from typing import Final

from feelahead.lab.approaches.frozen import AHEAD, PASSED
from feelahead.lab.approaches.laws import LAWS, Law
from feelahead.lab.approaches.pulls import PULL_KINDS, PullKind

LINKS: Final = {
    "0 ms": "",
    "50 ms": "delay 50ms 10ms distribution normal",
    "100 ms": "delay 100ms 10ms distribution normal",
    "200 ms": "delay 200ms 10ms distribution normal",
    "400 ms": "delay 400ms 10ms distribution normal",
    "200 ms, 5 % lost": "delay 200ms 10ms distribution normal loss 5%",
}
"""Each way."""
HOMES: Final = {"u_mesh": "mug", "mug": "mug"}
"""Scenes that start from another home pose than `empty`: where their approaches are recorded."""
_NOT_STILL = ("moving", "fleeing", "place_held", "terrain_ahead")
"""Left to `try approach`: things that move by themselves, or with the gripper, and a hill."""
STILL_AHEAD: Final = tuple(name for name in AHEAD if name not in _NOT_STILL)


@dataclass(frozen=True)
class Motion:
    """What is recorded once."""

    pull: PullKind
    link: str
    """A key of LINKS."""
    home: str = "empty"


@dataclass(frozen=True)
class Cell:
    """What is drawn for one motion."""

    motion: Motion
    scene: str
    camera_mm: float = 3.0
    encoder_factor: float = 1.0
    """How much worse than the settings' own the encoders are."""
    speed_m_s: float = 0.0
    """Of the objects, along the approach: below 0 they come nearer."""

    @property
    def shown(self) -> str:
        """The scene, and how it moves."""
        if self.speed_m_s == 0.0:
            return self.scene
        return f"{self.scene} {'fleeing' if self.speed_m_s > 0.0 else 'coming'} {1e3 * abs(self.speed_m_s):g} mm/s"

    @property
    def key(self) -> str:
        """What names it in tables, and for --only."""
        return "/".join(
            (
                self.shown,
                self.motion.pull,
                self.motion.link,
                f"camera {self.camera_mm:g} mm",
                f"encoders x{self.encoder_factor:g}",
            )
        )


@dataclass(frozen=True)
class Plan:
    """How much is done."""

    cells: tuple[Cell, ...]
    approaches: int
    """Recorded for each motion."""
    places: int
    """Of the objects, for each approach."""
    probabilities: tuple[float, ...]
    laws: tuple[Law, ...] = LAWS
    checked: int = 300
    """Approaches that are run again in full physics, closed loop."""
    raced: int = 10
    """Seeds for the time to a goal."""

    def motions(self) -> dict[Motion, list[Cell]]:
        """The cells by what is recorded for them."""
        found: dict[Motion, list[Cell]] = {}
        for cell in self.cells:
            found.setdefault(cell.motion, []).append(cell)
        return found


def full_plan(laws: tuple[Law, ...]) -> Plan:
    """Every scene with a steady pull over four links, every pull over two, and one factor at a time from there on.

    Drift and turning in more scenes, and things that come nearer or go away.
    """
    cells: dict[str, Cell] = {}

    def add(
        pull: PullKind,
        link: str,
        scene: str,
        camera_mm: float = 3.0,
        encoder_factor: float = 1.0,
        speed_m_s: float = 0.0,
    ) -> None:
        cell = Cell(Motion(pull, link, HOMES.get(scene, "empty")), scene, camera_mm, encoder_factor, speed_m_s)
        cells.setdefault(cell.key, cell)

    for link in LINKS:
        add("steady", link, "wall")
    for link in ("0 ms", "50 ms", "200 ms", "400 ms"):
        for scene in (*STILL_AHEAD, *PASSED):
            add("steady", link, scene)
    for pull in PULL_KINDS:
        for link in ("50 ms", "200 ms"):
            for scene in ("wall", "post", "rod_5mm", "wall_beside", "table_1_box", "cluttered"):
                add(pull, link, scene)
    for link in ("50 ms", "200 ms"):
        for scene in ("plate", "ball", "slot", "u_mesh", "mug"):
            add("drift", link, scene)
            add("yaw", link, scene)
        add("drift", link, "edge")
        add("yaw", link, "turn")
        for scene in ("wall", "ball"):
            for speed_m_s in (-0.06, 0.03):
                add("bell", link, scene, speed_m_s=speed_m_s)
    for camera_mm in (1.0, 6.0):
        for link in ("50 ms", "200 ms"):
            add("bell", link, "wall", camera_mm)
    add("bell", "200 ms", "wall", encoder_factor=10.0)
    return Plan(tuple(cells.values()), approaches=25, places=8, probabilities=(0.5, 0.9, 0.99, 0.999), laws=laws)


def quick_plan(laws: tuple[Law, ...]) -> Plan:
    """Some cells of the full plan with fewer draws: whether anything is wrong, not what holds."""
    near, far = Motion("steady", "50 ms"), Motion("bell", "200 ms")
    cells = (
        *(Cell(motion, scene) for motion in (near, far) for scene in ("wall", "rod_5mm", "wall_beside", "table_1_box")),
    )
    return Plan(cells, approaches=10, places=4, probabilities=(0.5, 0.9), laws=laws, checked=6, raced=2)
