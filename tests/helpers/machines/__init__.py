"""What the suites that need a machine share."""
