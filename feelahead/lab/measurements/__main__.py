"""Write each marked table of docs/ anew: python -m feelahead.lab.measurements.

With --study FOLDER, copy a study's outcomes and contrasts to figures/ instead.
"""

import argparse
from pathlib import Path

from feelahead.lab.measurements.documents import DOCUMENTS, FIGURES, written
from feelahead.lab.measurements.studies import copy

arguments = argparse.ArgumentParser(description=__doc__)
arguments.add_argument("--study", type=Path)
study = arguments.parse_args().study
if study is not None:
    copy(study, FIGURES)
else:
    for document in DOCUMENTS:
        document.write_text(written(document.read_text(encoding="utf-8")), encoding="utf-8")
