"""Strangers and hostile input at a real port."""
