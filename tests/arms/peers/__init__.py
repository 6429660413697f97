"""Arms at the other end of a driver: programs that run in environments of their own."""
