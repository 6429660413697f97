"""Progress of long work and tables of figures, as they are printed."""
