"""How far before each thing the strengths begin, against how far away it is."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from feelahead.experiments.field.looking import Look

_STRENGTHS = (1, 4, 8)
_LINES = (":", "--", "-")


def draw(found: Mapping[str, Sequence[Look]], frozen: str, path: Path) -> None:
    """A colour for each scene, a kind of line for each strength."""
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, axes = plt.subplots(figsize=(7.5, 4.2), dpi=110, layout="constrained")
    for number, (name, looks) in enumerate(found.items()):
        for strength, line in zip(_STRENGTHS, _LINES, strict=True):
            before = [look.free_mm - look.ways_mm[strength - 1] for look in looks]
            label = name if strength == _STRENGTHS[-1] else None
            axes.plot([look.free_mm for look in looks], before, line, color=f"C{number}", label=label)
    sigma_mm = next(iter(found.values()))[0].sigma_mm
    axes.axhline(sigma_mm, color="black", linewidth=0.6)
    axes.annotate("D_σ", (0.0, sigma_mm), textcoords="offset points", xytext=(2, 2), fontsize=8)
    axes.set(xlabel="free way of the gripper, mm", ylabel="begins so far before the contact, mm", ylim=(0.0, None))
    axes.legend(ncols=2, fontsize=8, title="strength 8 (full line), 4, 1 (dotted)", title_fontsize=8)
    figure.suptitle(f"where strength begins (frozen {frozen})", fontsize=9)
    figure.savefig(path)
    plt.close(figure)
