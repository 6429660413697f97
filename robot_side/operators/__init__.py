"""Who may command the arm, who observes, and what stops it."""
