"""Parts of `feelahead bench link`: samples of delays, and ends of a link in two real processes."""
