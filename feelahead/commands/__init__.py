"""Commands that people type after `feelahead`."""
