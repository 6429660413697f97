"""The guide docs/two-machines.md, followed on two machines in network namespaces, and what goes wrong on a LAN."""
