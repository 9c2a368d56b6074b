# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared fixtures: an own cache for each test, and functions that run a command line."""

import pytest

from laboratory.verbs import PACKAGES
from precompute.bake import self_check
from precompute.cli import parser


@pytest.fixture(scope="module", autouse=True)
def _bakes_are_checked_at_few_w(request):
    """Except where the self-check is the subject: at 16 values of w it takes half of a small bake's time."""
    with pytest.MonkeyPatch.context() as patch:
        if not {"bake", "check", "hostile"} & set(request.path.parts):
            patch.setattr(self_check, "GROUPS", 4)
        yield


@pytest.fixture(autouse=True)
def cache_folder(tmp_path_factory, monkeypatch):
    """The cache's folder, outside of tmp_path; it does not exist yet."""
    folder = tmp_path_factory.mktemp("own") / "cache"
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(folder))
    for name in ("MB", "DAYS", "SHARED"):
        monkeypatch.delenv(f"NATURAL_GRATINGS_CACHE_{name}", raising=False)
    return folder


@pytest.fixture
def run(capsys):
    """A function that runs a line of `./dev grating` and returns its status, standard output and standard error."""

    def run_line(*argv):
        capsys.readouterr()
        try:
            status = parser.main([str(each) for each in argv], PACKAGES)
        except SystemExit as end:
            status = end.code
        return status, *capsys.readouterr()

    return run_line


@pytest.fixture
def refused(run, tmp_path):
    """A function that runs a command line that must fail, and returns its error line. It checks the status, that
    standard output is empty, that the error is one line, and that nothing was written."""

    def run_line(*argv, status=1):
        before = contents(tmp_path)
        got, out, err = run(*argv)
        assert got == status
        assert out == ""
        assert err.startswith("error: ") and err.endswith("\n")
        assert len(err.splitlines()) == 1, err
        assert contents(tmp_path) == before
        # The line names the fault, and after the semicolon the remedy.
        assert "; " in err
        return err

    return run_line


def contents(folder):
    """The bytes of a folder's files by path, without empty folders."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
