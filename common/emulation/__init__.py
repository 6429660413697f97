"""Emulated links, in netem's words: profiles, and the delay line that applies them."""
