"""The port of any controller: state in, feel out, as values; and the controller that comes and goes."""
