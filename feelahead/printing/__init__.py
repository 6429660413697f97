"""Progress of long work, tables of figures, and pictures."""
