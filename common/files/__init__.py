"""Files that people name: where they are, and how they are read with care."""
