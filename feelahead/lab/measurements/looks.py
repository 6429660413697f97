"""Tables of what looks cost, of their error by definition, and of the spheres that cover grippers."""

from feelahead.lab.measurements.lines import Lines
from feelahead.lab.table import Table
from feelahead.printing.figures import short


def tick(rows: Table) -> Lines:
    """Yield the stages of the demo's tick, then the looks at concave objects."""
    yield "", "p50, us", "p99, us", "p50, ratio", "p99, ratio"
    demo = rows.where(case="demo")
    law = rows.where(case="demo, each stage timed", stage="whole look")
    looks = (row for row in rows if row["stage"].startswith("field of"))
    for row in (*demo, *law, *looks):
        yield row["stage"], *(short(row[name]) for name in ("p50_us", "p99_us", "p50_of_mixed", "p99_of_mixed"))


def definition(looks: Table) -> Lines:
    """Yield counts and errors of looks by the law's definition."""
    yield "looks", "distances", "latest, mm", "earliest, mm", "grazes", "grazes out of their tolerance"
    counts = {name: f"{sum(looks.values(name)):g}" for name in ("looks", "distances", "grazes", "out_of_band")}
    ends = f"{max(looks.values('latest_mm')):+.3f}", f"{min(looks.values('earliest_mm')):+.3f}"
    yield counts["looks"], counts["distances"], *ends, counts["grazes"], counts["out_of_band"]


def cover(parts: Table) -> Lines:
    """Yield how well spheres cover each part of the gripper, then all."""
    yield "part", "spheres", "sticks out of its spheres, mm", "spheres stand out, mm"
    for row in parts:
        yield row["part"], f"{row['spheres']:g}", short(row["sticks_out_mm"]), short(row["stands_out_mm"])
    yield (
        "all",
        f"{sum(parts.values('spheres')):g}",
        *(short(max(parts.values(name))) for name in ("sticks_out_mm", "stands_out_mm")),
    )
