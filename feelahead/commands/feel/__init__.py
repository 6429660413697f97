"""`feelahead feel`: the triggers' zones in the hand, and their forces on a kitchen scale, without a robot."""
