"""What the console shows, drawn in a terminal, for machines without a browser."""
