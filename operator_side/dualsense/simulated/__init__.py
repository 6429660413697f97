"""Controller without hardware, with a model of the triggers."""
