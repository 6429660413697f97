"""`feelahead doctor`: checks of this machine and of the path to a robot side."""
