"""The same simulated person with and without haptics, in scenes with something to hit."""
