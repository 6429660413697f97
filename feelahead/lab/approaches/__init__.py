"""Approaches of the gripper to objects, for several questions: pulls of a hand, runs of both sides, and judgements."""
