"""Likeliest offset and skew of two clocks, updated block by block."""

from typing import Literal

from common.timing.difference_blocks import MOST_BLOCKS, Block, BlockTrack
from common.timing.offset_fits import Average, Envelope, OffsetLine, fit_envelope, fit_mean, typical_skewness

_FIRST_BLOCK_S = 0.1
_LAST_BLOCK_S = 0.8
_HORIZON_S = 60.0
"""Age at which blocks are forgotten, in seconds, because the skew changes with the temperature."""
_SETTLED_BLOCKS = 10
_SYMMETRIC = (0.5, 0.8)
"""Skewness up to which the mean begins to be used, and above which it is used no longer. An exponential distribution
has 2, a normal one 0."""
_STEADY = (2.0, 3.0)
"""The same two limits for `Average.wander` of the blocks' means; independent delays have 0.67."""
_SHIFT_SCALES = 8.0
_LEAST_SHIFT_S = 1e-3
_SHIFTED_BLOCKS = 2
_DOUBTFUL_BLOCKS = 5
"""Number of successive doubtful blocks after which the delay counts as really shorter."""


class OffsetTracking:
    """Blocks of both directions, and the offset line fitted to them.

    The line is the lower envelope, because queues leave a minimum unchanged. If the delays of both directions have a
    symmetric distribution, it is the mean, because symmetric jitter has no clear minimum. Blocks last 0.1 s at first,
    for an early result, and 0.8 s later. Times and differences are in seconds from an origin that the caller chose
    on each clock.
    """

    def __init__(self) -> None:
        self.to_peer = BlockTrack()
        self.from_peer = BlockTrack()
        self.line: OffsetLine | None = None
        """Fitted offset line; None until both directions have a block."""
        self.estimator: Literal["lower envelope", "mean"] = "lower envelope"
        """Method by which `line` was fitted."""
        self._envelope: Envelope | None = None
        self._block_s = _FIRST_BLOCK_S
        self._block_ends_s = _FIRST_BLOCK_S
        self._doubtful_blocks = 0
        self._shifted_blocks = 0

    @property
    def settled(self) -> bool:
        """Whether both directions have enough blocks to judge the distribution of their delays."""
        return min(len(self.to_peer.blocks), len(self.from_peer.blocks)) >= _SETTLED_BLOCKS

    def advance(self, now_s: float, max_skew: float) -> bool:
        """Close the open blocks if their time is over. Return True on a clock jump; then discard this object.

        A jump shows in successive blocks: the delay of one direction falls by as much as that of the other rises, which
        no change of route causes.
        """
        if now_s < self._block_ends_s:
            return False
        self._block_ends_s = now_s + self._block_s
        to_peer, from_peer = self.to_peer.close(), self.from_peer.close()
        if self._is_doubtful(to_peer, from_peer):
            return self._shifted_blocks >= _SHIFTED_BLOCKS
        for track, block in ((self.to_peer, to_peer), (self.from_peer, from_peer)):
            if block is not None:
                track.keep(block, now_s - _HORIZON_S)
        if self._block_s < _LAST_BLOCK_S and MOST_BLOCKS in (len(self.to_peer.blocks), len(self.from_peer.blocks)):
            self._block_s *= 2.0
            self.to_peer.coarsen()
            self.from_peer.coarsen()
        self._fit(max_skew)
        return False

    def _is_doubtful(self, to_peer: Block | None, from_peer: Block | None) -> bool:
        """Return whether one of the newest blocks lies so far below the envelope that a clock may have jumped."""
        if self._envelope is None or not self.settled or to_peer is None or from_peer is None:
            return False
        to_floor, from_floor = self._envelope.to_peer, self._envelope.from_peer
        limit_s = _LEAST_SHIFT_S + _SHIFT_SCALES * (to_floor.scale_s + from_floor.scale_s)
        out_s, back_s = to_floor.excess(to_peer), from_floor.excess(from_peer)
        if min(out_s, back_s) >= -limit_s or self._doubtful_blocks == _DOUBTFUL_BLOCKS:
            self._doubtful_blocks = self._shifted_blocks = 0
            return False
        self._doubtful_blocks += 1
        self._shifted_blocks += abs(out_s + back_s) < limit_s
        return True

    def _fit(self, max_skew: float) -> None:
        to_peer, from_peer = self.to_peer.blocks, self.from_peer.blocks
        if not to_peer or not from_peer:
            return
        guess = 0.0 if self.line is None else self.line.skew
        self._envelope = fit_envelope(to_peer, from_peer, max_skew, guess)
        mean = self._fit_mean(max_skew)
        if mean is None:
            self.line, self.estimator = self._envelope.line, "lower envelope"
        else:
            self.line, self.estimator = mean, "mean"

    def _fit_mean(self, max_skew: float) -> OffsetLine | None:
        """Fit the line through the means; None if delays look asymmetric, or change slowly as those of a queue do."""
        leaving = self.estimator == "mean"  # hysteresis: harder to leave than to enter
        tracks = self.to_peer, self.from_peer
        for track in tracks:
            skewness = typical_skewness(track.blocks, _SETTLED_BLOCKS)
            if skewness is None or abs(skewness) > _SYMMETRIC[leaving]:
                return None
        to_peer, from_peer = (Average([block for block in track.blocks if block.count]) for track in tracks)
        line = fit_mean(to_peer, from_peer, max_skew)
        if max(to_peer.wander(line.skew), from_peer.wander(-line.skew)) > _STEADY[leaving]:
            return None
        return line
