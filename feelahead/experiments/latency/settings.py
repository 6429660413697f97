"""What `feelahead try latency` is told."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from common.emulation.clauses import LinkModel
from common.emulation.named_links import NAMED_LINKS
from common.files.output_file import require_output_file
from feelahead.lab.approaches.links import require_young_loop


@dataclass(frozen=True)
class LatencySettings:
    """A finger that pulls R2 with a constant force towards a wall, over links as they are: what the delay does.

    Each link with and without haptics, over the same seeds, and in several media: virtual time, two processes whose
    messages are held back by themselves, and containers with the kernel's netem between them. Then, whether the media
    agree on what the link does. Trials that run in real time take turns.
    """

    links: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME|SPEC...")] = tuple(NAMED_LINKS)
    """Links by name, or in netem's words, both ways."""
    haptics: tuple[Literal["on", "off"], ...] = ("on", "off")
    """Whether triggers are stiffened."""
    seeds: Annotated[int, tyro.conf.arg(metavar="N")] = 5
    """Trials of each kind; the seeds are 0 to N-1."""
    media: tuple[Literal["virtual", "loopback"], ...] = ("virtual", "loopback")
    """virtual: in this process, as fast as it goes. loopback: two processes on 127.0.0.1, in real time."""
    compose: bool = False
    """And in containers, with the kernel's netem between them."""
    model: LinkModel = "stream"
    """How a link is emulated: in order and losing nothing, as TCP does, or as datagrams."""
    force: Annotated[float, tyro.conf.arg(metavar="N")] = 3.0
    """Newtons on R2: 2 is a light pull, 3.7 a normal one."""
    duration: Annotated[float, tyro.conf.arg(metavar="SECONDS")] = 8.0
    """Of each trial, from the moment that the link is up; the pull begins after 1.3 s and a round trip or two."""
    out: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Write the picture (latency.png), every trial (trials.csv) and all of the tables (latency.json) there."""
    csv: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Write every trial there."""
    resume: Annotated[Path | None, tyro.conf.arg(metavar="FILE.jsonl")] = None
    """Write each trial there as soon as it is done, and leave out what is there already."""
    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.toml")] = None
    """These settings from a file."""

    def __post_init__(self) -> None:
        for name in ("links", "haptics", "media"):
            values = getattr(self, name)
            if len(set(values)) < len(values) or not (values or (name == "media" and self.compose)):
                raise ValueError(f"--{name} {' '.join(values)}: valid: one or more, each once")
        for link in self.links:
            require_young_loop(link, self.model)
        if self.seeds < 1:
            raise ValueError(f"--seeds {self.seeds}: valid: 1 or more")
        for name, low, high in (("force", 0.0, 20.0), ("duration", 2.0, 1000.0)):
            if not (math.isfinite(getattr(self, name)) and low <= getattr(self, name) <= high):
                raise ValueError(f"--{name} {getattr(self, name)}: valid: {low:g} to {high:g}")
        if self.out is not None and not self.out.absolute().parent.is_dir():
            raise ValueError(f"--out {self.out}: the folder around it is not there; valid: a folder's path")
        if self.out is not None and self.out.exists() and not self.out.is_dir():
            raise ValueError(f"--out {self.out}: is no folder; valid: a folder, or a new one")
        require_output_file("--csv", self.csv)
        require_output_file("--resume", self.resume)
