"""Views of the scene: pictures, rendered in a separate process, and shapes."""
