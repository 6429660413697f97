"""What people type after `feelahead`."""
