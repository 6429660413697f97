"""A hand that pulls and a gripper that approaches: runs, recordings, and their judgement, for several questions."""
