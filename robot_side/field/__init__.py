"""Objects ahead along a direction, and the onset distances of the strengths: eq. 5-12 and §4.2 in one compiled pass.

inflate (eq. 3-10) ─▶ contact of each sphere ─▶ overlap profiles (eq. 11-12) ─▶ onset distances
"""
