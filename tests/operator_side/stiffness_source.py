"""Robot side without an arm, whose stiffness the test sets or withholds."""

from common.protocol.codec import encode
from common.protocol.messages import MotionState
from tests.helpers.felt import felt
from tests.helpers.serving_robot import ServingRobot


class StiffnessSource(ServingRobot):
    """Robot side in a thread, as a context: it grants the lease, and sends stiffness every few milliseconds."""

    def __init__(self) -> None:
        super().__init__(publishes=False)
        self.r2 = 0
        """Strength in every zone of R2, 0 to 8"""
        self.state: MotionState = "armed"
        self.silent = False

    def tick(self, now_s: float) -> None:
        self.session.update(now_s)
        for owner in () if self.silent else self.session.owners(now_s):
            self.sockets.send(owner.peer, encode(felt(owner.header, r2=self.r2, state=self.state)))
