"""A controller made of bytes, with a model of its triggers."""
