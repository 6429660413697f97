"""A run recorded: what the core hears, as entries of a file."""
