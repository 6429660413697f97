"""What the public functions require of their arguments."""
