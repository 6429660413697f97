"""How long overlaps take: ours and the package's, calls of many sizes, vectors of two widths."""
