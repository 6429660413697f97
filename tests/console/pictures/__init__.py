"""Pictures and film of the documents: `make pictures`."""
