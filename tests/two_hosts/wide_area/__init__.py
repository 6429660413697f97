"""Trials over the kernel's TCP: delay, loss, rate and queue of a wide-area network between two network namespaces."""
