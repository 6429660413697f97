"""Run robot side and operator side together: in one process and virtual time, or as two processes in real time."""
