"""Parts that all commands share: settings, status, stop signals, orderly ends."""
