"""Views of the scene: pictures that a separate process renders, and shapes."""
