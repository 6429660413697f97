"""How old a message is, and how far apart two clocks are."""
