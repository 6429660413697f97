"""Marked tables of docs/, made from the CSV files in figures/ (`python -m feelahead.lab.measurements`)."""
