"""Parts of `feelahead bench tick`: a robot side that measures its ticks, and frames with many objects."""
