"""`feelahead controller`: one controller in the hand, without a robot: its zones, its travel and its forces."""
