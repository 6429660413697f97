"""What the law's look ahead may save: run time against error of what is felt, one setting at a time."""
