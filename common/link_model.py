"""Emulated links, as an interface for users' code: a profile in netem's words, and the delay line that applies it."""

from common.emulation.delay_line import DelayLine
from common.emulation.profile import LinkProfile

__all__ = ["DelayLine", "LinkProfile"]
