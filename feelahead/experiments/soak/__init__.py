"""`feelahead try soak`: long runs."""
