"""A cable that is really pulled: a virtual Ethernet link between network namespaces, set down in mid-motion.

Needs root and iproute2's `ip`; without them the row says so.
"""

from feelahead.experiments.faults.fault import Outcome
from feelahead.experiments.faults.real_faults import Advance, Onsets
from feelahead.experiments.faults.rig import Rig, stands
from feelahead.experiments.faults.two_machines import NotPermittedError, two_machines


def unplugged(repeats: int, advance: Advance) -> Outcome:
    """Both sides in namespaces of their own; the link between them is set down while the arm moves, then up again."""
    onsets, safe = Onsets(), True
    try:
        with (
            two_machines() as (robot, operator),
            Rig(f"tcp://{robot.address}:5555", ["--insecure"], robot.surroundings) as rig,
        ):
            driver = rig.driver(before=operator.surroundings)
            for _ in rig.rounds(repeats, advance, 120.0):
                evenly = rig.drive(driver)
                rig.lines()
                robot.unplug()
                told = onsets.take(rig, evenly=evenly)["told_to_move"]
                rig.wait(0.5)
                robot.plug_in()
                rig.until(driver, "phase", "rest")
                figures = rig.figures()
                safe &= figures["told_to_move"] == told and stands(figures)
    except NotPermittedError as error:
        return Outcome(True, f"skipped: {error}", judged=False)
    return onsets.outcome(safe=safe)
