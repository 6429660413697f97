"""The console's facts, drawn in a terminal, for machines without a browser."""
