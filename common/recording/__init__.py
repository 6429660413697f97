"""Recording of a run: every input of the cores and all views, in one MCAP file, without waiting."""
