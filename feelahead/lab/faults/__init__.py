"""The parts of `try faults`: each fault of the table, in virtual time or with real processes."""
