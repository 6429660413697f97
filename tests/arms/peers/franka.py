"""FR3 of franka-sim, which speaks libfranka's protocol and enforces its limits.

Arguments: HOST LOG [WIDTH], the width in m of what is always between the fingers. FR3_MJCF names the arm's model.
Order on the standard input: `reflex`, as of a hand that was hit.
"""

import sys
from collections.abc import Sequence

from franka_sim.franka_sim_server import FrankaSimServer

from tests.arms.peers.positions import hear_orders, log_positions

_CARTESIAN_REFLEX = 7
"""Place of this error among libfranka's"""


def main(host: str, log: str, between_m: str = "") -> None:
    """Serve until a signal ends it."""
    server = FrankaSimServer(
        host=host,
        enforce_comm_constraints=True,
        enforce_motion_limits=True,
        gripper_object_width=float(between_m) if between_m else None,
    )

    def positions() -> Sequence[float]:
        found = tuple(server.physics_sim.get_robot_state()["q"])
        return found if any(found) else ()  # franka-sim says zeros until its physics has begun

    log_positions(log, positions)
    hear_orders(lambda _: server._abort_with_error(_CARTESIAN_REFLEX, "ordered"))  # nothing public aborts
    print("serves", flush=True)
    server.start()


if __name__ == "__main__":
    main(*sys.argv[1:])
