"""A run judged: its figures, and how near the truth says that things came."""
