"""Surfels: small pieces of surface, from points that pictures show, and what speaks for and against each."""
