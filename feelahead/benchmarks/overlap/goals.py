"""What the kernels are to reach, each as a ratio or a count of figures measured in the same run."""

from feelahead.benchmarks.overlap.meshes import FEW_TRIANGLES
from feelahead.benchmarks.overlap.times.speed import TIMED_SOLIDS, TRIVIAL
from feelahead.benchmarks.overlap.times.widths import wide_vectors_pay
from feelahead.benchmarks.report import Figure, Goal, Report, short

FASTER, FASTER_WITH_WIDE_VECTORS = 13.0, 16.0
"""Times the C++ package's speed, and where vectors of 512 bits are measured to pay."""


def judge(report: Report, processor: str) -> None:
    """Add every goal to the report, from its figures; `processor` names what they were measured on."""
    report.goals += [
        _worst_of(report, "worst error over every class, of the sphere", "accuracy", "worst error", 1e-15),
        _tiny(report),
        *_counts(report),
        *_speed(report, processor),
        _mesh(report),
        _worst_of(
            report,
            "direction of the gradient, overlaps from 1e-12 of the sphere, rad",
            "directions",
            "worst direction error",
            1e-6,
        ),
    ]


def _worst_of(report: Report, claim: str, section: str, quantity: str, limit: float) -> Goal:
    found = [f for f in report.figures if (f.section, f.method, f.quantity) == (section, "ours", quantity)]
    if not found:
        return Goal(claim, None, limit)
    worst = max(found, key=lambda figure: figure.value)
    return Goal(
        claim, worst.value, limit, detail=f"{worst.case}, {worst.solid}" if section != "accuracy" else worst.case
    )


def _tiny(report: Report) -> Goal:
    deep = [f for f in report.figures if f.section == "tiny" and f.method == "ours" and not f.case.endswith("1e-9")]
    worst: Figure | None = max(deep, key=lambda figure: figure.value, default=None)
    claim = "relative error of face, edge and corner overlaps of depth >= 1e-6 R"
    if worst is None:
        return Goal(claim, None, 1e-9)
    return Goal(claim, worst.value, 1e-9, detail=f"{worst.solid}, {worst.case}")


def _counts(report: Report) -> list[Goal]:
    pairs = report.value("stress", "ours", "all", "adversarial", "pairs")
    claims = [
        ("false zeros", "adversarial", "false_zeros"),
        ("negative volumes", "adversarial", "negative"),
        ("exceptions", "adversarial", "exceptions"),
        ("NaN", "adversarial", "nan"),
        ("NaN or infinity let pass", "NaN and infinity", "silent"),
        ("errors above 1e-6 of the sphere", "with truth", "large errors"),
    ]
    missed = report.value("stress", "ours", "all", "adversarial", "largest_missed")
    of = "" if pairs is None else f"of {pairs:.0f} adversarial pairs"
    details = {} if not missed else {"false zeros": f"{of}, of which the largest misses {short(missed)} of the sphere"}
    goals = [
        Goal(
            claim,
            report.value("stress", "ours", "all", case, quantity),
            0.0,
            detail=details.get(claim, of if case == "adversarial" else ""),
        )
        for claim, case, quantity in claims
    ]
    for claim, quantity in (("change under relabelling", "asymmetry"), ("loss as the radius grows", "shrinking")):
        value = report.value("stress", "ours", "all", "adversarial", quantity)
        goals.append(Goal(f"{claim}, of the sphere", value, 1e-15, detail=of))
    return goals


def _speed(report: Report, processor: str) -> list[Goal]:
    goals = []
    least = FASTER_WITH_WIDE_VECTORS if wide_vectors_pay(report) else FASTER
    for solid in TIMED_SOLIDS:
        ours, peer = (
            report.value("speed", method, solid, "partial", "time") for method in ("ours, checked", "overlap, C++")
        )
        claim = f"times faster than the C++ package, {solid}, checked, with gradient"
        ratio = None if peer is None or ours is None else peer / ours
        detail = "" if ratio is None else f"{peer:.0f} / {ours:.0f} ns a pair; {processor}"
        goals.append(Goal(claim, ratio, least, "at least", detail or "the C++ package was not measured"))
    for solid in TIMED_SOLIDS:
        for name in TRIVIAL:
            value = report.value("speed", "ours, checked", solid, name, "time")
            goals.append(Goal(f"ns a trivial pair, {solid}, {name}", value, 10.0))
    return goals


def _mesh(report: Report) -> Goal:
    claim = f"mesh query with up to {FEW_TRIANGLES} triangles touched, in boxes"
    box_ns = report.value("speed", "ours, kernel", "box", "partial", "time")
    touched = {f.case: f.value for f in report.figures if f.section == "mesh" and f.quantity == "triangles"}
    times = {f.case: f.value for f in report.figures if f.section == "mesh" and f.quantity == "time"}
    few = [case for case, count in touched.items() if count <= FEW_TRIANGLES]
    if box_ns is None or not few:
        return Goal(claim, None, 20.0)
    slowest = max(few, key=lambda case: times[case])
    return Goal(claim, times[slowest] / box_ns, 20.0, detail=f"{slowest}, {touched[slowest]:.0f} triangles")
