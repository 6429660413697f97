"""Questions to the whole, and the engine that answers them: `feelahead bench NAME` and `feelahead try NAME`."""
