"""Tables of what looks cost, of errors, and of the spheres that cover grippers."""

from math import isfinite
from statistics import median

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


def stability(tallies: Table) -> Lines:
    """Yield a row for each part and kind of error: its worst class. Cases without a limit have rows of their own."""
    yield "part", "cases", "worst error", "limit", "NaN, infinity, exceptions", "error is"
    tried = Table(row for row in tallies if row["measure"] is not None)
    for (part, limit, measure), those in tried.groups("part", "limit", "measure"):
        undefined = sum(those.values("undefined")) + sum(those.values("exceptions"))
        worst = max(those, key=lambda row: float(row["error"]))
        where = f"{short(worst['error'])} ({worst['case']})" if worst["error"] else "0"
        allowed = short(limit) if isfinite(limit) else "none"
        yield part, f"{sum(those.values('cases')):g}", where, allowed, f"{undefined:g}", measure


def tiles(looks: Table) -> Lines:
    """Yield a row for each size and roughness of tiles: how much later full strength begins, and the clearance."""
    ahead, beside = looks.where(scene="ahead", gap_m=0.0), looks.where(scene="beside", camera_sd_m=1e-3)
    angles, kinds = sorted(set(ahead.values("tilt_deg"))), ("each", "surface")
    each = [(kind, tilt_deg) for kind in kinds for tilt_deg in angles]
    yield "tiles", *(f"{kind}, at {tilt_deg:g}°" for kind, tilt_deg in each), "free from, mm: each / surface / whole"
    for (tile_m, roughness_m), those in ahead.groups("tile_m", "roughness_m"):
        later = [those.where(**{"as": kind}, tilt_deg=tilt_deg).values("o8_mm") for kind, tilt_deg in each]
        clear = beside.where(tile_m=tile_m, roughness_m=roughness_m)
        free = [row["free_mm"] for kind in kinds for row in clear.where(**{"as": kind})] + clear.values("true_free_mm")
        yield (
            f"{1e3 * tile_m:g} mm, ±{1e3 * roughness_m:g} mm",
            *(f"{median(one):+.1f}" if one else "" for one in later),
            " / ".join(f"{one:.2f}" for one in free[: len(kinds) + 1]),
        )
