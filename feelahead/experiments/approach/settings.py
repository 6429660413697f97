"""What `feelahead try approach` is told, and the approaches that follow from it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from common.emulation.clauses import LinkModel
from common.files.input_file import require_input_file
from common.files.output_file import require_output_file
from common.protocol.messages import Compensation, Vector2
from feelahead.lab.approaches.approach import Approach
from feelahead.lab.approaches.frozen import AHEAD, ASIDE, GRIPPED, SCENES, SITE, frozen_scene
from feelahead.lab.approaches.laws import Law, with_compensation
from feelahead.lab.approaches.links import require_young_loop
from feelahead.lab.approaches.spoilt import Spoil
from feelahead.lab.figures import PICTURES
from robot_side.settings import Assist


@dataclass(frozen=True)
class ApproachSettings:
    """A finger that presses R2 with a constant force, until the gripper touches something or comes to rest.

    Both sides run in virtual time with the real messages, link, trigger effects and physics: the same command
    gives the same figures. Without --model, every frozen scene of tests/data that ends in a contact is tried. Options
    that take several values are combined with each other; with one of each, the summary is that run's own.
    """

    model: Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE.xml...")] = ()
    """MJCF scenes with an arm; objects ahead of its tool are what it may hit."""
    site: Annotated[str, tyro.conf.arg(metavar="NAME")] = SITE
    """The site between the fingertips, z along the approach."""
    force: Annotated[tuple[float, ...], tyro.conf.arg(metavar="N...")] = (3.0,)
    """Newtons on R2, 0 to 20: 2 is a light pull, 3.7 a normal one."""
    strongest_effect: Annotated[tuple[float, ...], tyro.conf.arg(metavar="N...")] = (2.0,)
    """Newtons that the strongest effect adds (nobody has measured it): 1.5, 2 and 3 span what is likely."""
    link: Annotated[tuple[str, ...], tyro.conf.arg(metavar="SPEC...")] = ("",)
    """Emulated links, both ways, in netem's words: "delay 200ms 10ms distribution normal"."""
    link_model: LinkModel = "datagram"
    """datagram lets jitter reorder messages, stream keeps them in order."""
    law: tuple[Literal["swept", "paper", "none", "full"], ...] = ("swept",)
    """What is felt: what is ahead along the trigger, the paper's plain law, nothing, or always the strongest effect.
    Several are set side by side."""
    compensation: tuple[Compensation, ...] = ("operator",)
    """Who reckons with the delay: the operator side by the commands under way, or the robot side by v t_d (eq. 8). The
    paper's law has eq. 8."""
    haptics: bool = True
    """Without: the same as --law none."""
    probability: Annotated[float, tyro.conf.arg(metavar="P")] = 0.99
    """The laws' own P (eq. 10)."""
    duration: Annotated[float, tyro.conf.arg(metavar="SECONDS")] = 8.0
    """From the beginning of the pull, in virtual time; a contact ends the run."""
    seed: Annotated[int, tyro.conf.arg(metavar="N")] = 0
    """The first seed, for the errors of camera, encoders and link."""
    seeds: Annotated[int, tyro.conf.arg(metavar="N")] = 1
    """How many seeds."""
    grip: bool = False
    """Close the gripper on what stands between its fingers first."""
    stick: Annotated[tuple[float, float], tyro.conf.arg(metavar="RIGHT UP")] = (0.0, 0.0)
    """Deflection, at most 1 long, of the stick that moves across, for the first 1.5 s: up to 0.1 m/s."""
    turn: Annotated[tuple[float, float], tyro.conf.arg(metavar="RIGHT UP")] = (0.0, 0.0)
    """Deflection, at most 1 long, of the stick that turns, for the first 1.5 s: up to 0.5 rad/s."""
    assist: Assist = "none"
    """speed: the robot side caps the speed along the triggers itself."""
    camera_mm: Annotated[float, tyro.conf.arg(metavar="MM")] = 3.0
    """Standard deviation of the camera's error, which the law knows."""
    spoil: Spoil = "nothing"
    """Spoil what is felt, to see that the figures notice: 100 ms late, or on the other trigger."""
    workers: Annotated[int, tyro.conf.arg(metavar="N")] = 2
    """Runs at the same time."""
    summary: Annotated[Path | None, tyro.conf.arg(metavar="FILE.json")] = None
    """Write the figures there."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.png")] = None
    """Draw zones, travel, speed and gap over time (one run), or contact speed against delay (several)."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file."""

    def __post_init__(self) -> None:
        for name, values, low, high in (
            ("force", self.force, 0.0, 20.0),
            ("strongest-effect", self.strongest_effect, 0.0, 20.0),
            ("duration", (self.duration,), 0.05, 1000.0),
            ("camera-mm", (self.camera_mm,), 0.0, 1000.0),
        ):
            for value in values:
                if not (math.isfinite(value) and low <= value <= high):
                    raise ValueError(f"--{name} {value}: valid: {low:g} to {high:g}")
        for name in ("force", "strongest_effect", "link", "law", "compensation"):
            if not getattr(self, name):
                raise ValueError(f"--{name.replace('_', '-')}: valid: one value or more")
        for name in ("stick", "turn"):
            if not math.hypot(*getattr(self, name)) <= 1.0 + 1e-9:  # false for NaN, too
                raise ValueError(f"--{name} {getattr(self, name)}: valid: two numbers, together at most 1 long")
        if not 0.0 < self.probability < 1.0:
            raise ValueError(f"--probability {self.probability}: valid: above 0 and below 1")
        for name, lowest in (("seed", 0), ("seeds", 1), ("workers", 1)):
            if getattr(self, name) < lowest:
                raise ValueError(f"--{name} {getattr(self, name)}: valid: {lowest} or more")
        for spec in self.link:
            require_young_loop(spec, self.link_model)
        self._require_files()

    def _require_files(self) -> None:
        for model in self.model:
            require_input_file("--model", model, "an MJCF file")
        require_output_file("--summary", self.summary)
        require_output_file("--picture", self.picture, PICTURES)

    def models(self) -> tuple[Path, ...]:
        """The scenes to try; ConfigurationError where the frozen ones are not there."""
        return self.model or tuple(frozen_scene(name) for name in (*AHEAD, *ASIDE))

    def sticks(self, model: Path) -> tuple[Vector2, Vector2]:
        """How the sticks are deflected: as told, or as a frozen scene that a straight pull passes wants them."""
        frozen = model.parent.resolve() == SCENES and self.stick == self.turn == (0.0, 0.0)
        return ASIDE.get(model.stem, (self.stick, self.turn)) if frozen else (self.stick, self.turn)

    def laws(self) -> tuple[Law, ...]:
        """What is set side by side, each once."""
        if not self.haptics:
            return ("none",)
        return tuple(dict.fromkeys(with_compensation(law, side) for law in self.law for side in self.compensation))

    def approaches(self) -> Iterator[Approach]:
        """Every combination, the seeds innermost."""
        for model in self.models():
            for link in self.link:
                for force_n in self.force:
                    for strongest_n in self.strongest_effect:
                        for law in self.laws():
                            for seed in range(self.seed, self.seed + self.seeds):
                                yield Approach(
                                    model=model,
                                    force_n=force_n,
                                    site=self.site,
                                    strongest_n=strongest_n,
                                    link=link,
                                    link_model=self.link_model,
                                    law=law,
                                    probability=self.probability,
                                    duration_s=self.duration,
                                    seed=seed,
                                    grip=self.grip or (model.parent.resolve() == SCENES and model.stem in GRIPPED),
                                    spoil=self.spoil,
                                    stick=self.sticks(model)[0],
                                    turn=self.sticks(model)[1],
                                    assist=self.assist,
                                    camera_sd_m=1e-3 * self.camera_mm,
                                )
