"""Adaptation of pictures to a narrow link: first their rate, then their quality, then their size."""

import math
from typing import Final, NamedTuple

_LEAST_RATE_HZ: Final = 5.0
_LEAST_QUALITY: Final = 30
_QUALITY_STEP: Final = 15
_RATE_STEP: Final = 0.75
_HALF_COST: Final = 0.4
"""Bytes of a picture of half the width and height, as a share of the full picture's"""
_ROOM: Final = 0.8
"""Maximum share of the rate left for pictures that the next better step may need: hysteresis"""
_PATIENCE_S: Final = 1.0
_EAGER_S: Final = 0.15
"""Time, in seconds, before a better step is taken while the link has shown no limit; afterwards `_PATIENCE_S`"""
_FIRST_BYTES: Final = {False: 20_000.0, True: 1_500.0}
"""Bytes of a picture of quality 75 and full size that are assumed before the first picture; the key tells whether it is
H.264"""


class Step(NamedTuple):
    """Step of the pictures' rate, quality and size."""

    rate_hz: float
    quality: int
    halved: bool
    """Whether pictures have half the width and height"""

    def bytes_share(self, *, h264: bool = False) -> float:
        """Return the bytes of a picture as a share of those at quality 75 and full size; measured on rendered scenes.

        h264: for an H.264 picture that contains the changes since another.
        """
        of_quality = math.exp(0.032 * (self.quality - 75)) if h264 else 0.13 + 0.0116 * self.quality
        return of_quality * (_HALF_COST if self.halved else 1.0)


def steps(rate_hz: float, quality: int) -> tuple[Step, ...]:
    """Return all steps, from the rate and quality given down to the least ones."""
    made = [Step(rate_hz, quality, halved=False)]
    while (rate := made[-1].rate_hz) > _LEAST_RATE_HZ:
        made.append(made[-1]._replace(rate_hz=max(_LEAST_RATE_HZ, _RATE_STEP * rate)))
    while (worse := made[-1].quality) > _LEAST_QUALITY:
        made.append(made[-1]._replace(quality=max(_LEAST_QUALITY, worse - _QUALITY_STEP)))
    return (*made, made[-1]._replace(halved=True))


class PictureRateControl:
    """Controller of the step of all views: down at once, up by one step after a second in which the link has room."""

    def __init__(self, rate_hz: float, quality: int) -> None:
        self._steps = steps(rate_hz, quality)
        self._at = 0
        self.most_hz, self.halved = math.inf, False
        """Greatest rate that the viewers keep up with, and whether only with half the width and height"""
        self._h264 = False
        self._full_bytes: dict[bool, float] = {}
        """Bytes of a picture of quality 75 and full size; the key tells whether it is H.264"""
        self._crowded_s = -math.inf

    @property
    def step(self) -> Step:
        """Present step"""
        return self._limited(self._at)

    def _limited(self, at: int) -> Step:
        step = self._steps[at]
        return step._replace(rate_hz=min(step.rate_hz, self.most_hz), halved=step.halved or self.halved)

    def made(self, size_bytes: int, step: Step, *, h264: bool = False) -> None:
        """Update the known size of pictures by a picture that was made in `step`."""
        full_bytes = size_bytes / step.bytes_share(h264=h264)
        known_bytes = self._full_bytes.get(h264, full_bytes)
        self._full_bytes[h264] = known_bytes + 0.1 * (full_bytes - known_bytes)

    def update(self, left_bit_s: float, views: int, now_s: float, *, eager: bool = False, h264: bool = False) -> Step:
        """Choose the step for `views` watched views, with `left_bit_s` left for pictures, in bit/s.

        eager: whether the link has shown no limit yet. h264: whether pictures are H.264.
        """
        if h264 != self._h264:
            self._h264, self._at = h264, 0
        while self._at < len(self._steps) - 1 and self._needed_bit_s(self._at, views) > left_bit_s:
            self._at += 1
            self._crowded_s = now_s
        if self._at == 0 or self._needed_bit_s(self._at - 1, views) > _ROOM * left_bit_s:
            self._crowded_s = now_s
        elif now_s - self._crowded_s >= (_EAGER_S if eager else _PATIENCE_S):
            self._at -= 1
            self._crowded_s = now_s
        return self.step

    def _needed_bit_s(self, at: int, views: int) -> float:
        step = self._limited(at)
        full_bytes = self._full_bytes.get(self._h264, _FIRST_BYTES[self._h264])
        return 8.0 * views * step.rate_hz * step.bytes_share(h264=self._h264) * full_bytes
