"""References for comparison: exact overlaps, classes on which algorithms fail, contact distances by definition."""
