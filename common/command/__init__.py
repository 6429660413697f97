"""What every command line needs: settings, status, stop signals, orderly ends."""
