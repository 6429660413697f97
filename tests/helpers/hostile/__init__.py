"""Helpers that send invalid and hostile input to a real port, as any stranger on the network could."""
