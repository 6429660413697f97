"""Parts of `bench tick`: a robot side that times its ticks, and many more objects than a scene has."""
