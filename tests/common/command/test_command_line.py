import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import pytest
from msgspec import Meta

from common.command.command_line import load_toml, parse_settings
from common.command.run_options import RunOptions
from common.limits import check_limits
from tests.helpers.refusal import refusal


@dataclass(frozen=True)
class Inner:
    sd_m: float = 0.1

    def __post_init__(self) -> None:
        if not self.sd_m >= 0.0:
            raise ValueError(f"sd_m = {self.sd_m}; valid: 0 or more")


@dataclass(frozen=True)
class Options(RunOptions):
    probability: float = 0.99
    camera: Inner = field(default_factory=Inner)
    size_m: Annotated[float, Meta(ge=0.0)] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_limits(self)


def parse(*arguments: str) -> Options:
    return parse_settings(Options, "prog", arguments)


def test_flags_win_over_the_file_which_wins_over_defaults(tmp_path: Path) -> None:
    path = tmp_path / "options.toml"
    path.write_text("probability = 0.5\nseed = 3\n[camera]\nsd_m = 0.2\n")
    options = parse("--config", str(path), "--seed", "4")
    assert (options.probability, options.seed, options.camera.sd_m) == (0.5, 4, 0.2)
    assert parse(f"--config={path}", "--camera.sd-m", "0.3").camera.sd_m == 0.3
    assert parse().probability == 0.99


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["--nonsense", "1"], "--nonsense"),
        (["--seed", "x"], "--seed"),
        (["--seed", "-1"], "-1"),
        (["--camera.sd-m", "-2"], "--camera.sd-m = -2.0; valid: 0 or more"),
        (["--size-m", "-1"], "--size-m = -1.0; valid: at least 0"),
        (["--duration", "0"], "0.0"),
        (["--link", "delay -5ms"], "-5ms"),
        (["--link-model", "pigeon"], "pigeon"),
        (["--config"], "--config"),
        (["--config", "missing.toml"], "missing.toml"),
        (["--summary", "no/such/folder/out.json"], "no/such/folder"),
    ],
)
@pytest.mark.parametrize("terminal", [False, True])
def test_bad_flags_become_one_line_that_names_them(
    arguments: list[str], named: str, terminal: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal)  # as tyro looks there before it writes in colours
    monkeypatch.setenv("TERM", "xterm")
    text = refusal(parse, *arguments)
    assert named in text
    assert text.isprintable()
    assert "│" not in text
    assert "[0m" not in text


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("probabilty = 0.9", "probabilty"),
        ("[camera]\nsd = 1.0", "camera.sd"),
        ("[camera]\nsd_m = -1.0", "sd_m = -1.0"),
        ("seed = -4", "-4"),
        (f"probability = 1{400 * '0'}", "more than 64 bits"),
        (f"seed = 1{5000 * '0'}", "more than 64 bits"),
        (f"seed = {4500 * '['}", "nested too deeply"),
        (f"camera{4500 * '.a'} = 1", "nested too deeply"),
        (9000 * "a" + " = 1", "unknown key"),
        ('config = "other.toml"', "unknown key 'config'"),
        (f"[{9000 * 'a'}]\n[{9000 * 'a'}]", "no valid TOML"),
        ("#" * 1_000_001, "too large; valid: up to 1000000 bytes"),
    ],
)
def test_bad_files_become_one_line_that_names_file_and_key(tmp_path: Path, content: str, named: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(content)
    text = refusal(load_toml, path, Options)
    assert named in text
    assert "bad.toml" in text
    assert "sys." not in text
    assert len(text) < 1000
