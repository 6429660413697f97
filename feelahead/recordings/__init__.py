"""What can be done with a recording: compute its run again, show it, export it, draw it."""
