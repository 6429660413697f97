"""Tables of coverage: which cells hold, and false alarms; by depth cameras, too."""

from typing import Final

from feelahead.lab.approaches.evaluation import LINKS
from feelahead.lab.approaches.pulls import PULL_KINDS
from feelahead.lab.measurements.lines import Lines
from feelahead.lab.questions import coverage as question
from feelahead.lab.table import Row, Table


def coverage(cells: Table) -> Lines:
    """Yield a row for each pull and link; entries of the probabilities are separated by a slash."""
    yield (
        "pull",
        "link",
        "cells that hold",
        "covered at least (scene, at the greatest P)",
        "false alarms a minute",
        "share of the time",
    )
    order = PULL_KINDS.index, list(LINKS).index
    groups = Table(sorted(cells, key=lambda row: (order[0](row["pull"]), order[1](row["link"])))).groups("pull", "link")
    for (pull, link), those in groups:
        of = [rows for _, rows in those.groups("probability")]
        ahead = [Table(row for row in rows if row["coverage"] is not None) for rows in of]
        holds = [f"{sum(rows.values('holds')):g}" for rows in ahead]
        least = [min(rows, key=lambda row: float(row["coverage"])) for rows in ahead]
        yield (
            *(pull, link, f"{' / '.join(holds)} of {len(ahead[-1])}"),
            " / ".join(f"{row['coverage']:.3f}" for row in least) + f" ({least[-1]['scene']})",
            *map(" / ".join, zip(*map(question.pooled_alarms, of), strict=True)),
        )


def alarms(cells: Table) -> Lines:
    """Yield a row for each kind of scene and pull, over all probabilities; of swerves in clutter one for each link."""
    yield "scenes", "pull", "link", "false alarms a minute", "share of the time", "minutes"
    clutter, passed = cells.where(scene="cluttered"), Table(row for row in cells if row["coverage"] is None)
    ahead = Table(row for row in cells if row["coverage"] is not None)
    moving = Table(row for row in ahead if row["scene"].endswith("mm/s"))
    resting = Table(row for row in ahead if not row["scene"].endswith("mm/s"))
    free = Table(row for row in passed if row["scene"] != "cluttered")
    kinds = [
        ("nothing ahead", "all", "all", free),
        ("clutter beside", "all but swerve", "all", Table(row for row in clutter if row["pull"] != "swerve")),
        *(("clutter beside", "swerve", link, rows) for (link,), rows in clutter.where(pull="swerve").groups("link")),
        *(("an object ahead", pull, "all", rows) for (pull,), rows in resting.groups("pull")),
        ("an object that comes", "bell", "all", Table(row for row in moving if "coming" in row["scene"])),
        ("an object that flees", "bell", "all", Table(row for row in moving if "fleeing" in row["scene"])),
    ]
    for name, pull, link, rows in kinds:
        yield name, pull, link, *question.pooled_alarms(rows), f"{sum(rows.values('judged_s')) / 60.0:.0f}"


def laws(cells: Table) -> Lines:
    """Yield a row for each law; entries of the probabilities are separated by a slash."""
    yield "law", "cells that hold", "covered", "false alarms a minute", "share of the time"
    for (law,), those in cells.groups("law"):
        of = [rows for _, rows in those.groups("probability")]
        holds = [f"{sum(rows.values('holds')):g}" for rows in of]
        yield (
            *(law, f"{' / '.join(holds)} of {len(of[-1].values('coverage'))}"),
            " / ".join(question.mean(rows, "coverage") for rows in of),
            *map(" / ".join, zip(*map(question.pooled_alarms, of), strict=True)),
        )


_AS_MEASURED: Final = "noise x1, mount 2 mm"
_OTHER_ERRORS: Final = ("noise x0, mount 2 mm", "noise x2, mount 2 mm", "noise x1, mount 0 mm", "noise x1, mount 6 mm")


def depth(cells: Table) -> Lines:
    """Yield a row for each scene: the objects themselves perceived, then each choice of cameras."""
    eyes = ("fixed", "wrist", "both")
    yield "scene", "objects perceived", *(f"{name} camera{'s' * (name == 'both')}" for name in eyes)
    for (scene,), those in cells.groups("scene"):
        yield scene, *(_seen(those, by) for by in ("objects", *(f"{name}, {_AS_MEASURED}" for name in eyes)))


def other_errors(cells: Table) -> Lines:
    """Yield a row for each scene and choice of cameras: other noise, other errors of the mounts."""
    yield "scene", "cameras", *(errors.replace("x", "x ") for errors in _OTHER_ERRORS)
    for eyes in ("both", "fixed", "wrist"):
        for (scene,), those in cells.groups("scene"):
            entries = [_seen(those, f"{eyes}, {errors}") for errors in _OTHER_ERRORS]
            if any(entries):
                yield scene, eyes, *entries


def _seen(cells: Table, seen_by: str) -> str:
    """Return coverage and false alarms a minute; bold with its interval's lower end where the cell does not hold."""
    return " ".join(f"{_share(row)}, {row['alarms_per_min']:.0f}" for row in cells.where(seen_by=seen_by))


def _share(row: Row) -> str:
    if row["coverage"] is None:
        return "nothing ahead"
    return f"{row['coverage']:.2f}" if row["holds"] else f"**{row['coverage']:.2f} [{row['low']:.2f}]**"
