"""What a person sees of this side: facts of the core, the terminal, the console and its pages."""
