from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.files.toml_file import read_toml


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "a.toml"


def test_a_file_and_a_link_to_one_are_read(path: Path) -> None:
    path.write_text('a.b = [9223372036854775807, -9223372036854775808]\nname = "größer"', encoding="utf-8")
    content = {"a": {"b": [2**63 - 1, -(2**63)]}, "name": "größer"}
    assert read_toml(path, 100) == content
    link = path.with_name("link.toml")
    link.symlink_to(path)
    assert read_toml(link, 100) == content


def test_what_the_system_does_not_let_us_at(path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_toml(path, 100)
    with pytest.raises(IsADirectoryError):
        read_toml(path.parent, 100)
    path.symlink_to(path)
    with pytest.raises(OSError, match="symbolic links"):
        read_toml(path, 100)


TOKENS = st.sampled_from(
    ["a", "b", "=", "1", "0x", "f", "[", "]", "{", "}", ".", "'", '"', "\n", "\x00", "e", "99999", ","]
)


@given(st.lists(TOKENS | st.text(max_size=3), max_size=60), st.integers(1, 400))
def test_any_text_is_read_or_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, tokens: list[str], times: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes("".join(token * (times if number == 3 else 1) for number, token in enumerate(tokens)).encode())
    said = ""
    try:
        read_toml(path, 10_000)
    except ValueError as error:
        said = str(error)
    assert "\n" not in said
    assert len(said) < 500
