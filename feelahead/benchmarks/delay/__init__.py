"""Clock offsets and one-way delays against the truth."""
