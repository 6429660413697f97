"""`feelahead try field`: how far from things each strength begins, and what a look ahead costs."""
