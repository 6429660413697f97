"""Run time against error of the exact overlaps."""
