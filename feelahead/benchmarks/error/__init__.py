"""`feelahead bench error`: what the error propagation and the prediction of the commands under way miss."""
