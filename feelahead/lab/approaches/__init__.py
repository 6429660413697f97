"""A hand that pulls, a gripper that approaches, and whether it hits: what experiments and benchmarks share."""
