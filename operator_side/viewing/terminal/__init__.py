"""View of the console's facts in a terminal, for machines without a browser."""
