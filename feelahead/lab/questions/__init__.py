"""The questions, one in each file: its cells, how to run one cell, its tables, figures and goals."""
