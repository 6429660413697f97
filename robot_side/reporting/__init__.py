"""What leaves for the operator side: which message, when, and by which way."""
