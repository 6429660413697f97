"""Being on time: deadlines, priority, garbage collection."""
