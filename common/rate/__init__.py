"""The amount that a side may send, and its order, so that no queue of our own making stands in the link."""
