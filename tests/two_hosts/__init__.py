"""The guide docs/two-machines.md, followed on two machines in network namespaces, and the faults of a LAN."""
