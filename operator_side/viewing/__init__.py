"""Views of this side for a person: facts of the core, the terminal, the console and its pages."""
