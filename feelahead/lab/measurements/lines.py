"""Lines of a table in Markdown, headings first."""

from collections.abc import Iterable

Lines = Iterable[Iterable[str]]
