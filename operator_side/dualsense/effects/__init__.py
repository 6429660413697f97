"""What a trigger can be told to do, and the bytes that say so."""
