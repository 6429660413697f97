"""Emulated links, for users: one profile in netem's words, and the line that carries it out."""

from common.emulation.delay_line import DelayLine
from common.emulation.profile import LinkProfile

__all__ = ["DelayLine", "LinkProfile"]
