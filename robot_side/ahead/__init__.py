"""What is ahead along a direction, and from how far it is to be felt: eq. 5-12 and §4.2 in one compiled pass.

gripper, scene ─▶ find: D_σ (eq. 3-10), free ways ─▶ overlap kernels (eq. 11-12) ─▶ feel: ways at which strengths begin
"""
