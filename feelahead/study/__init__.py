"""A study with people: its protocol, its plan for each participant, and its journal."""
