"""Robot side, operator side and a router between them in containers, with the programs that docker/ starts."""
