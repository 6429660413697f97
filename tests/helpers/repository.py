"""Root of the repository, for tests that read its files or start its commands."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"
