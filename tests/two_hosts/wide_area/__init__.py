"""The kernel's own TCP over a wide area: delay, loss, rate and queue between two network namespaces, for trials."""
