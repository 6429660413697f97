"""What all else is held against: exact overlaps, classes that break algorithms, and the ways by definition."""
