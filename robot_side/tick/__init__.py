"""Records of one tick: what its steps hand to each other, and to listeners. They import no step."""
