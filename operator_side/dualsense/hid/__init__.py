"""Real controllers: finding, opening, reading, writing, and releasing them however the program ends."""
