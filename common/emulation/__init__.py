"""Emulated links, specified in netem's words: profiles, and the delay line that applies a profile to messages."""
