"""The browser console: a process of its own, behind a gate that lets in who has this run's token."""
