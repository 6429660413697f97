"""A control and a view socket for each of the two processes, over ZeroMQ.

Control (ROUTER and DEALER) carries small messages both ways, view (PUB and SUB) frames and telemetry to
the operator, apart so that a frame never delays a stiffness. No call but `wait` blocks; a message that cannot
leave now is dropped and counted, because a newer one follows. A shell belongs to one thread.

Only this package knows ZeroMQ: `shell` has what both ends share, `authentication` who may connect, `robot` and
`operator` the two ends.
"""

from common.sockets.operator import OperatorSockets
from common.sockets.robot import RobotSockets

__all__ = ["OperatorSockets", "RobotSockets"]
