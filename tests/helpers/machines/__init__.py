"""Helpers of test suites that need a virtual machine, network namespaces, or programs of Debian packages."""
