"""Real-time parts of a loop: deadlines, priority, garbage collection."""
