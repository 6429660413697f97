"""What an experiment keeps: every input of the cores and what people look at, in one MCAP file, without waiting."""
