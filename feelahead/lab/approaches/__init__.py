"""Approaches for several questions: a hand that pulls, runs of both sides, recordings and their judgement."""
