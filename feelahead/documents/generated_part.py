"""Documents of which a command writes the part between two marks."""

BEGIN, END = "<!-- begin of the generated part -->", "<!-- end of the generated part -->"


def with_generated_part(document: str, text: str) -> str:
    """`document` with `text` between its marks; ValueError when they are missing."""
    before, found, rest = document.partition(BEGIN)
    _, closed, after = rest.partition(END)
    if not (found and closed):
        raise ValueError(f"document lacks its marks; valid: one line {BEGIN} and, further down, one line {END}")
    return f"{before}{BEGIN}\n{text.strip()}\n{END}{after}"
