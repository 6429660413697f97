"""The table of what operators read has every text of the code, and the state that shows it."""

from tests.house.texts import DOCUMENT, document


def test_the_table_of_texts_is_that_of_the_code() -> None:
    written = document()
    new = [line for line in written.splitlines() if line.endswith("| ? |")]
    assert not new, f"write into {DOCUMENT.name} when each of these is shown, after: python -m tests.house.texts"
    assert DOCUMENT.read_text(encoding="utf-8") == written, "python -m tests.house.texts"
