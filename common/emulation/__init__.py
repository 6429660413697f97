"""A bad link, in the words of netem: profiles, and the line that carries them out."""
