"""Links by haptics by seeds, in several media: what the delay does, and whether the media agree."""
