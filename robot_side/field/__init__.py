"""Onset distances of the strengths, from the objects ahead along one direction: eq. 5-12 and §4.2 in one compiled call.

inflate (eq. 3-10) ─▶ contact of each sphere ─▶ overlap profiles (eq. 11-12) ─▶ onset distances
"""
