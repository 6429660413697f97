"""First motions of an arm: its limits are measured, and its joints, signs and gripper are checked."""
