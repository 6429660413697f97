"""References that all else is held against: exact overlaps, classes that break algorithms, the ways by definition."""
