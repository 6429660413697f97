"""Every row of the fault table, in virtual time and with real processes."""
