"""What is ahead along a direction, and from how far it is to be felt: eq. 5-12 and §4.2 in one compiled pass.

inflate (eq. 3-10) ─▶ contact of each sphere ─▶ overlap profiles (eq. 11-12) ─▶ ways at which strengths begin
"""
