"""`feelahead demo`: its settings, one run of both sides, and the console's page, which outlives a run."""
