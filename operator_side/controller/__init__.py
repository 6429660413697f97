"""Port of any controller, state in and feel out as values; and the connection that finds and loses one."""
