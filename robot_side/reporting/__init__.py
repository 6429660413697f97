"""Messages to the operator side: their content, when they leave, and over which connections."""
