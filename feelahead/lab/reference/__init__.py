"""References for comparison: exact overlaps, pairs on which algorithms fail, onset distances by their definition."""
