"""Files that people name: their places, and careful reading and writing."""
