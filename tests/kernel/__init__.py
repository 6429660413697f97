"""Tests of our virtual controller and a stock Debian kernel's driver hid-playstation, in QEMU: `make test-kernel`."""
