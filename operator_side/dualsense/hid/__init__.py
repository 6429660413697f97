"""Real controllers: finding, opening, reading, writing, and letting go of them on every way out."""
