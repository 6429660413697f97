"""The few figures of the robot side's scene that are read as words: its overlaps and its ticks."""

from common.command.live_view import Value
from common.errors import RemoteProtocolError
from common.protocol.codec import claims_to_be, decode_view
from common.protocol.view_messages import SceneState


class SceneFigures:
    """Keeps the newest SceneState's bytes, and unpacks them when somebody asks."""

    def __init__(self) -> None:
        self._newest: bytes | None = None
        self._figures: dict[str, Value] = {}

    def take(self, payload: bytes) -> None:
        """One payload of the topic `scene`; shapes, which are large, are passed over."""
        if claims_to_be("scene", payload):
            self._newest = payload

    def figures(self) -> dict[str, Value]:
        """As status values; empty before the first."""
        payload, self._newest = self._newest, None
        if payload is not None:
            try:
                state = decode_view(payload)
            except RemoteProtocolError:
                return self._figures
            if isinstance(state, SceneState):
                by_trigger = zip(*((l2, r2) for _, l2, r2 in state.overlaps), strict=True)
                self._figures = {
                    "overlap_mm3": 1e9 * max(map(sum, by_trigger), default=0.0),
                    "tick_us": state.tick_p50_us,
                    "tick_p99_us": state.tick_p99_us,
                    "overruns": state.overruns,
                }
        return self._figures
