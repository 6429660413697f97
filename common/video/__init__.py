"""Decoding of H.264 pictures, each the changes since the previous one, to JPEG, through PyAV."""
