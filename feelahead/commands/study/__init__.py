"""`feelahead study`: run a study, check its protocol, plan it, report on it."""
