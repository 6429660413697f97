"""What happens to people and robots under delay, faults and attacks: `feelahead try`."""
