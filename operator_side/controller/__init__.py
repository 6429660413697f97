"""Interface of any controller (states come in, effects go out, both as values), and the connection to one."""
