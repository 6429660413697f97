"""Conversion, through PyAV, of H.264 pictures to JPEG; most of them hold only the changes since the previous one."""
