"""One question a file: the cells to try, the run of one cell, and the tables, figures and goals."""
