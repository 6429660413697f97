"""Write a report: the page, and tidy tables beside it."""

from pathlib import Path
from typing import Final

from common.errors import ConfigurationError
from common.extras import require_packages
from common.files.output_file import output_file
from feelahead.study.report import summaries
from feelahead.study.report.contrasts import compare
from feelahead.study.report.outcomes import Tables
from feelahead.study.report.page import page

PAGE: Final = "report.html"
EXTRA: Final = ("statsmodels", "pandas", "pyarrow", "matplotlib")
"""Packages of the extra `study`"""


def require_extra(what: str) -> None:
    """Raise ConfigurationError, with the command that installs the extra `study`, if one of its packages is missing."""
    require_packages(what, *EXTRA, extra="study")


def write_report(tables: Tables, folder: Path) -> Path:
    """Write report.html, and trials, answers, contrasts and cells as Parquet, into `folder`; return the page's path.

    The same tables give the same bytes. ConfigurationError if a package is missing or a file cannot be written.
    """
    require_extra("study report")
    import pandas as pd  # noqa: PLC0415

    found = compare(tables)
    frames = {
        "trials": tables.trials,
        "answers": tables.answers,
        "contrasts": pd.DataFrame([one.row for one in found]),
        "cells": summaries.cells(tables),
    }
    for name, frame in frames.items():
        path = folder / f"{name}.parquet"
        try:
            frame.to_parquet(path, index=False)
        except OSError as error:
            raise ConfigurationError(f"study report {path}: cannot be written: {error.strerror or error}") from error
    with output_file("study report", folder / PAGE) as file:
        file.write(page(tables, found))
    return folder / PAGE
