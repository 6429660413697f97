"""Questions to the whole system, and the engine that answers them: `feelahead bench NAME` and `feelahead try NAME`."""
