"""How fast and how exact things are, beside what is used in their place: `feelahead bench`."""
