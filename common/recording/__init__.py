"""Recording of a run into one MCAP file: all inputs of both sides' cores, and all views. A side never waits for it."""
