"""Pictures that say what has changed since the one before: from H.264 to JPEG, through PyAV."""
