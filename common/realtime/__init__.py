"""Parts that keep a loop on time: deadlines, priority, garbage collection, and monitoring of the period."""
