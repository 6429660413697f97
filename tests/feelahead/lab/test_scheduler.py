"""A cluster over TLS admits certificates of its own authority only; what is open to others is said."""

import re
import shlex
import shutil
import subprocess
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from common.errors import ConfigurationError
from feelahead.lab import pieces
from feelahead.lab.sweep import ask
from tests.feelahead.lab.clusters import dask_cluster
from tests.feelahead.lab.counting import QUESTION
from tests.helpers.repository import ROOT


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the files of an authority and of a machine, and a second machine's that another authority signed."""
    if shutil.which("openssl") is None:
        pytest.skip("openssl is not installed here")
    text = (ROOT / "feelahead" / "lab" / "README.md").read_text(encoding="utf-8")
    folder = tmp_path_factory.mktemp("certificates")
    for place in (folder, folder / "other"):
        place.mkdir(exist_ok=True)
        for command in re.findall(r"^    (openssl .*)$", text, re.MULTILINE):
            subprocess.run(shlex.split(command), cwd=place, capture_output=True, check=True)
    locked = ["openssl", "pkcs8", "-topk8", "-in", "own.key", "-out", "locked.key", "-passout", "pass:secret"]
    subprocess.run(locked, cwd=folder, capture_output=True, check=True)
    (folder / "open.key").write_bytes((folder / "own.key").read_bytes())
    (folder / "open.key").chmod(0o644)
    return folder


def _pem(folder: Path, ca: str = "ca.pem", own: str = "own") -> list[str]:
    files = {"ca": ca, "cert": f"{own}.pem", "key": f"{own}.key"}
    return [f"--tls-{flag}={folder / name}" for flag, name in files.items()]


@pytest.mark.processes
def test_a_cluster_over_tls_admits_who_has_a_certificate_of_its_authority_only(
    tmp_path: Path,
    certificates: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    theirs = [flag.replace("--tls-ca=", "--tls-ca-file=") for flag in _pem(certificates)]
    with dask_cluster(1, "tls", *theirs) as (address, _):
        assert address.startswith("tls://")
        here, there = tmp_path / "here.csv", tmp_path / "there.csv"
        assert ask(QUESTION, ["--workers", "1", "--csv", str(here)]) == 0
        assert ask(QUESTION, ["--scheduler", address, *_pem(certificates), "--csv", str(there)]) == 0
        assert there.read_bytes() == here.read_bytes()
        assert capsys.readouterr().err == ""
        monkeypatch.setattr("feelahead.lab.cluster._CONNECT_S", "2s")
        for refused in (
            [address, *_pem(certificates, own="other/own")],
            [address, *_pem(certificates, ca="other/ca.pem")],
            [address.replace("tls", "tcp")],
        ):
            with pytest.raises(ConfigurationError, match=r"no dask scheduler .*answers there"):
                ask(QUESTION, ["--scheduler", *refused])


@pytest.mark.processes
@pytest.mark.parametrize(
    ("address", "files", "said"),
    [
        ("tls://127.0.0.1:1", (), "needs certificates; valid: also --tls-ca, --tls-cert and --tls-key"),
        ("tcp://127.0.0.1:1", ("ca.pem", "own.pem", "own.key"), "is not encrypted, so "),
        ("tls://127.0.0.1:1", ("ca.key", "own.pem", "own.key"), "ca.key: cannot be used ("),
        ("tls://127.0.0.1:1", ("ca.pem", "other/own.pem", "own.key"), "own.key: cannot be used ("),
        (
            "tls://127.0.0.1:1",
            ("ca.pem", "own.pem", "none.key"),
            "none.key: cannot be used (No such file",
        ),
        ("tls://127.0.0.1:1", ("ca.pem", "own.pem", "open.key"), "open.key: other users may read it (mode 0644)"),
        ("tls://127.0.0.1:1", ("ca.pem", "own.pem", "locked.key"), "locked.key: cannot be used ("),
        ("ucx://127.0.0.1:1", (), "is no address; valid: an address such as tcp://127.0.0.1:8786 or tls://"),
    ],
)
def test_certificates_that_cannot_be_used_are_refused_in_a_line(
    address: str, files: Sequence[str], said: str, certificates: Path
) -> None:
    given = zip(("--tls-ca", "--tls-cert", "--tls-key"), (str(certificates / name) for name in files), strict=False)
    with pytest.raises(ConfigurationError, match=re.escape(said)) as refused:
        ask(QUESTION, ["--scheduler", address, *(word for pair in given for word in pair)])
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("address", "warns"),
    [
        ("tcp://127.0.0.1:8786", False),
        ("tcp://[::1]:8786", False),
        ("tcp://localhost:8786", False),
        ("tcp://192.0.2.1:8786", True),
        ("tcp://[2001:db8::1]:8786", True),
    ],
)
def test_a_scheduler_that_others_reach_without_certificates_is_said(
    address: str, warns: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(pieces, "cluster", lambda *_: ThreadPoolExecutor(1))
    assert ask(QUESTION, ["--scheduler", address]) == 0
    line = (
        f"feelahead try counting: --scheduler {address}: not encrypted, and anyone who reaches it runs code on its "
        "machines and on this one; tls://HOST:PORT admits certificates only\n"
    )
    assert capsys.readouterr().err == (line if warns else "")
