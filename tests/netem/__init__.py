"""The kernel's own netem, in User-Mode Linux, beside our emulation of it: `make test-netem`."""
