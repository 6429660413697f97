"""Hand of the simulated robot: what its inputs do, its gap, its drive and its cover of spheres."""
