"""Parts of every command line: settings, status, stop signals, orderly ends."""
