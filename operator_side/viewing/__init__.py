"""Views of a run for a person at the operator side: facts from the core, shown in the terminal or on console pages."""
