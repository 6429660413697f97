"""One pair of a box or tetrahedron, as exactly as it takes."""
