"""Stock Debian kernel in QEMU, whose own hid-playstation drives our virtual controller: `make test-kernel`."""
