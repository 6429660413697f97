"""Messages to the operator side: content, time and link."""
