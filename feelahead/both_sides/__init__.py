"""The robot side and the operator side together: in one process and virtual time, or as two processes."""
