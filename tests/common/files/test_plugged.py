import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from common.files import plugged
from common.files.plugged import find, installed, known, made_of, require_methods, require_name

Write = Callable[[str, str], Path]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Write]:
    """Return a function that writes a file of somebody's; what it imports is forgotten afterwards."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    before = set(sys.modules)

    def write(name: str, content: str) -> Path:
        path = tmp_path / name
        path.write_text(content, encoding="utf-8")
        return path

    yield write
    for name in set(sys.modules) - before:
        del sys.modules[name]


@pytest.fixture
def package(write: Write) -> None:
    """An installed package that registers a law that works, one that is broken, and a controller."""
    module = write("somebodys_package.py", "law = 'a law'\n")
    write("somebodys_broken_package.py", "import none_such\n")
    sys.path.insert(0, str(module.parent))
    folder = module.parent / "somebodys-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: somebodys\nVersion: 1.0\n", encoding="utf-8")
    (folder / "entry_points.txt").write_text(
        "[feelahead.laws]\ntheirs = somebodys_package:law\nbroken = somebodys_broken_package:law\n"
        "[feelahead.controllers]\npad = somebodys_package:none_such\n",
        encoding="utf-8",
    )
    importlib.invalidate_caches()


def test_a_part_is_built_in_of_a_file_or_of_a_package(write: Write, package: None) -> None:
    del package
    built_in = {"ours": 1}
    assert find("law", "ours", built_in) == 1
    write("beside.py", "two = 2\n")
    mine = write("json.py", "from beside import two\nlaw = two\n")  # a name that Python has, too
    assert find("law", str(mine), built_in) == 2
    write("json.py", "law = 3\n")
    assert find("law", str(mine), built_in) == 3
    assert find("law", "theirs", built_in) == "a law"
    assert known("law") == ["broken", "theirs"]


def test_what_is_installed_is_told_with_its_fault(package: None) -> None:
    del package
    found = {one.name: one for one in installed()}
    hidden = {one.name: one.fault for one in installed({"law": ["theirs"]})}
    assert hidden["theirs"] == "the built-in law theirs hides it"
    assert found["theirs"].fault is None
    assert found["theirs"].package == "somebodys 1.0"
    assert (
        found["broken"].fault == "ModuleNotFoundError, somebodys_broken_package.py line 1: No module named 'none_such'"
    )
    assert (found["pad"].kind, found["pad"].fault) == (
        "controller",
        "AttributeError: module 'somebodys_package' has no attribute 'none_such'",
    )


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("none.py", None, "there is no such file; valid: a Python file that defines law"),
        ("empty_law.py", "", "the file defines no law; valid: a Python file that defines law"),
        ("wrong_law.py", "law = (\n", "SyntaxError, wrong_law.py line 1: '(' was never closed"),
        ("failing_law.py", "\n1 / 0\n", "ZeroDivisionError, failing_law.py line 2: division by zero"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(
    write: Write, tmp_path: Path, name: str, content: str | None, said: str
) -> None:
    path = tmp_path / name if content is None else write(name, content)
    with pytest.raises(ConfigurationError) as refused:
        find("law", str(path), {})
    assert str(refused.value) == f"law {path}: {said}"


def test_an_unknown_name_is_refused_with_what_is_valid_and_nobodys_code_is_run(package: None) -> None:
    del package
    said = "law 'swep': there is no such law; valid: swept, broken, theirs, a file such as ./mine.py"
    with pytest.raises(ConfigurationError) as refused:
        require_name("law", "swep", ["swept"])
    assert str(refused.value) == said
    with pytest.raises(ConfigurationError) as refused:
        find("law", "swep", {"swept": 1})
    assert str(refused.value) == said
    for name in ("swept", "broken", "./none.py"):
        require_name("law", name, ["swept"])
    assert "somebodys_broken_package" not in sys.modules


def test_what_lacks_a_method_is_named_with_all_that_it_lacks() -> None:
    class Half:
        def read(self) -> None: ...

    with pytest.raises(
        ConfigurationError, match=r"^pad: Half lacks write\(feel\); valid: an object with read\(\), write"
    ):
        require_methods("pad", Half(), {"read": "", "write": "feel"})
    methods = {"perceive": "now_s"}
    assert made_of("perception", None, "simulated", methods) == "simulated"
    for given, said in (
        (3, "is of type int; valid: a function that takes the simulated one"),
        (lambda camera: camera / 0, "TypeError, test_plugged.py line"),
        (lambda camera: camera, "str lacks perceive"),
    ):
        with pytest.raises(ConfigurationError, match=said):
            made_of("perception", given, "simulated", methods)


def test_every_kind_has_its_group() -> None:
    assert {f"feelahead.{group}" for group in plugged.PLURALS.values()} >= {"feelahead.laws", "feelahead.controllers"}
