"""Recording of an episode, as both sides make one: inputs, messages and status, in an MCAP file."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from common.errors import FeelaheadError
from common.files.output_file import require_output_file
from common.recording.content import Content
from common.recording.entries import pack_block
from common.recording.mcap_file import RecordingFile
from common.recording.provenance import provenance
from common.recording.side import require_recordable
from common.recording.wire import BLOCK, HEADER, STATUS, VIEW, as_json, stamped
from common.status.statuses import SideStatus
from feelahead.both_sides.loopback import VIRTUAL_CLOCK, Loopback
from operator_side import recorded as operator_recorded
from operator_side.settings import OperatorSettings
from robot_side.compiled.warm_up import kernel_digests
from robot_side.recording import recorder as robot_recorded
from robot_side.settings import RobotSettings

BLOCK_S: Final = 0.05
_FLUSH_BLOCKS: Final = 15


class EpisodeRecording:
    """Recording of both sides: the robot side's listeners call `note`; `operator` is the other side's listener.

    `write` is called at `next_s`.
    """

    def __init__(
        self,
        path: Path,
        robot: RobotSettings,
        operator: OperatorSettings,
        wall_clock_s: float,
        given: Mapping[str, str],
    ) -> None:
        """Check the path. wall_clock_s: time of day, in seconds since 1970, at the episode's start.

        given: what the settings do not say of the episode, in words.
        """
        require_output_file("record", path)
        require_recordable(path)
        self._noted: tuple[list[Any], list[Any]] = ([], [])
        self.note: Callable[[Any], None] = self._noted[0].append
        self.operator = operator_recorded.OperatorRecorder(self._noted[1].append)
        self._encoders = robot_recorded.RobotEncoder(), operator_recorded.OperatorEncoder()
        self._settings = robot, operator
        self._status: tuple[Callable[[float], SideStatus], ...] = ()
        self._file = RecordingFile(path, wall_clock_s)
        self._content = Content(self._file)
        self._given = given
        self._blocks, self._written_s = 0, 0.0
        self._path = path

    def follow(self, loop: Loopback) -> None:
        """Write the headers of both sides, whose kernels are known by now."""
        self._status = loop.robot.status, loop.operator.status
        robot, operator = self._settings
        headers = (
            {"side": "robot", **provenance(robot, 1, VIRTUAL_CLOCK), "kernels": kernel_digests(), "given": self._given},
            {"side": "operator", **provenance(operator, 2, VIRTUAL_CLOCK)},
        )
        for source, header in enumerate(headers):
            self._content.write(source, HEADER + as_json(header))

    @property
    def next_s(self) -> float:
        """Time at which `write` is due next"""
        return (self._blocks + 1) * BLOCK_S

    def write(self, now_s: float) -> None:
        """Write what both sides have noted since the last call."""
        for source, noted in enumerate(self._noted):
            views: list[bytes] = []

            def view(when_s: float, payload: bytes, views: list[bytes] = views) -> None:
                views.append(stamped(when_s) + payload)

            entries = b"".join(self._encoders[source].encode(entry, view)[1] for entry in noted)
            noted.clear()
            self._content.write(source, BLOCK + pack_block(self._blocks, 0, self._written_s, now_s, entries))
            for seen in views:
                self._content.write(source, VIEW + seen)
            self._content.write(source, STATUS + stamped(now_s) + as_json(self._status[source](now_s)))
        self._blocks, self._written_s = self._blocks + 1, now_s
        if self._blocks % _FLUSH_BLOCKS == 0:
            self._file.flush()

    def close(self, now_s: float) -> None:
        """Write the rest, until `now_s`, and finish the file; FeelaheadError if it could not be written."""
        if now_s > self._written_s:
            self.write(now_s)
        self._file.close()
        if self._file.error is not None:
            raise FeelaheadError(f"record {self._path}: {self._file.error}")
