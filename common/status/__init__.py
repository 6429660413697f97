"""Status of each side: one struct of codes and figures for each. Only displays translate the codes into words."""
