"""Strangers and hostile input at a real robot side's port."""
