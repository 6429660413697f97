"""FR3 of franka-sim, which speaks libfranka's protocol and enforces its limits.

Arguments: HOST LOG [WIDTH], the width in m of what is always between the fingers. FR3_MJCF names the arm's model.
"""

import sys
from collections.abc import Sequence

from franka_sim.franka_sim_server import FrankaSimServer

from tests.arms.peers.positions import log_positions


def main(host: str, log: str, between_m: str = "") -> None:
    """Serve until a signal ends it."""
    server = FrankaSimServer(
        host=host,
        enforce_comm_constraints=True,
        enforce_motion_limits=True,
        gripper_object_width=float(between_m) if between_m else None,
    )

    def positions() -> Sequence[float]:
        found: Sequence[float] = server.physics_sim.get_robot_state()["q"]
        return found

    log_positions(log, positions)
    print("serves", flush=True)
    server.start()


if __name__ == "__main__":
    main(*sys.argv[1:])
