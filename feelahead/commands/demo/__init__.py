"""`feelahead demo`: settings, one run of both sides, and the page that outlives it."""
