"""One approach over time, and contact speed against delay for each law."""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Final

from common.emulation.spec import LinkSpec
from feelahead.experiments.approach.table import scene_names
from feelahead.lab.approaches.approach import Approach
from feelahead.lab.approaches.laws import in_words
from feelahead.lab.approaches.outcome import Outcome
from feelahead.lab.figures import LAW_COLOURS

_APART_MS: Final = 6.0
_MARKS: Final = ("o", "s", "^", "D", "v", "P", "X")


def draw_run(approach: Approach, outcome: Outcome, frozen: str, path: Path) -> None:
    """R2's zones and travel, speed and gap over time."""
    from matplotlib import pyplot as plt  # noqa: PLC0415

    trace = outcome.trace
    figure, (zones, motion) = plt.subplots(2, 1, figsize=(8.0, 5.6), dpi=110, sharex=True, layout="constrained")
    end_s = max(float(trace.time_s[-1]), 0.01)
    shown = zones.imshow(
        trace.strengths.T,
        aspect="auto",
        origin="lower",
        extent=(0.0, end_s, 0.0, 1.0),
        cmap="Greys",
        vmin=0,
        vmax=8,
        interpolation="nearest",
    )
    zones.plot(trace.time_s, trace.travel, color="#d55e00", label="the finger")
    zones.set(ylabel="travel of R2", ylim=(0.0, 1.0))
    zones.legend(loc="upper left")
    figure.colorbar(shown, ax=zones, label="strength, 0 to 8")
    motion.plot(trace.time_s, 1e3 * trace.speed_m_s, color="#0072b2", label="speed, mm/s")
    motion.plot(trace.time_s, 1e3 * trace.gap_m, color="#009e73", linestyle="--", label="true gap, mm")
    motion.axhline(0.0, color="black", linewidth=0.6)
    if outcome.contact_speed_mm_s is not None:
        motion.plot(outcome.ended_s, outcome.contact_speed_mm_s, "x", color="black", label="contact")
    motion.set(xlabel="seconds since the pull began", xlim=(0.0, end_s))
    motion.legend()
    link = approach.link or "no delay"
    title = f"{approach.force_n:g} N in {approach.model.stem}, law {in_words(approach.law)}, {link} (frozen {frozen})"
    figure.suptitle(title, fontsize=9)
    figure.savefig(path)
    plt.close(figure)


def draw_comparison(ended: Sequence[tuple[Approach, Outcome]], frozen: str, path: Path) -> None:
    """Contact speed against the one-way delay: a panel for each force, a line for each law and scene.

    A run that stops before the contact counts as 0 mm/s; one that ends otherwise is left out.
    """
    from matplotlib import pyplot as plt  # noqa: PLC0415

    forces = sorted({one.force_n for one, _ in ended})
    scenes = scene_names([one.model for one, _ in ended])
    laws = list(dict.fromkeys(one.law for one, _ in ended))
    size = (4.2 * len(forces) + 1.6, 4.2)
    figure, panels = plt.subplots(
        1, len(forces), figsize=size, dpi=110, sharey=True, squeeze=False, layout="constrained"
    )
    for panel, force_n in zip(panels[0], forces, strict=True):
        for place, law in enumerate(laws):
            for number, (scene, name) in enumerate(scenes.items()):
                points: dict[float, list[float]] = {}
                for one, outcome in ended:
                    told = outcome.end in ("contact", "stopped")
                    if told and (one.force_n, one.law, one.model) == (force_n, law, scene):
                        speed = outcome.contact_speed_mm_s or 0.0
                        points.setdefault(_one_way_ms(one), []).append(speed)
                delays = sorted(points)
                label = f"{in_words(law)}, {name}" if force_n == forces[0] else None
                panel.plot(
                    [delay + _APART_MS * place for delay in delays],
                    [median(points[delay]) for delay in delays],
                    marker=_MARKS[number % len(_MARKS)],
                    color=LAW_COLOURS[law],
                    alpha=0.7,
                    label=label,
                )
        panel.set(title=f"{force_n:g} N", xlabel="delay each way, ms (beside each other: the laws)")
        panel.grid(alpha=0.3)
    panels[0][0].set_ylim(bottom=-5.0)
    panels[0][0].set_ylabel("speed at contact, mm/s (0: none)")
    figure.legend(loc="outside right upper", fontsize=7)
    figure.suptitle(f"frozen {frozen}", fontsize=8)
    figure.savefig(path)
    plt.close(figure)


def _one_way_ms(approach: Approach) -> float:
    """Half of what both ways take."""
    link = LinkSpec.parse(approach.link, 0, approach.link_model)
    return 500.0 * sum(link.profile(direction).mean_delay_s() for direction in ("to_robot", "to_operator"))
