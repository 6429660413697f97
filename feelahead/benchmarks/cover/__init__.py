"""`feelahead bench cover`: how closely a gripper's spheres cover it, measured both ways."""
