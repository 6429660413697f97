"""What is done with a recording afterwards: computed anew, shown, exported, drawn."""
