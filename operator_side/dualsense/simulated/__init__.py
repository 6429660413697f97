"""A controller without hardware, with a model of the triggers."""
