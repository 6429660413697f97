"""The table of faults of docs/link.md, row by row in virtual time; tests hold each one."""
