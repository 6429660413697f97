"""Real controllers: finding, opening, reading, writing, and releasing them on every exit."""
