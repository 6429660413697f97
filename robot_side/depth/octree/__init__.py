"""Few large boxes behind many surfels, by an octree whose nodes stay as they are as long as they may."""
