# SPDX-License-Identifier: GPL-3.0-or-later
"""A run prints only its own lines, on every terminal and for every file name; and full disks."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from devtools.steps import project_environment

from .conftest import LASER, PICTURE, SHORT

PROGRAM = (sys.executable, "-m", "precompute")
ASCII = {"LC_ALL": "C", "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
# A name in letters, a name with commands for a terminal, and a name that is not text.
NAMES = ("Größe µ 格.png".encode(), b"a\nerror: b\x1b[2J\x1b]0;c\x07\xe2\x80\xae.png", b"\xff\xfe.png")
# Each name on an ASCII terminal, and the second one on a UTF-8 terminal.
TERMINALS = [*((name, ASCII) for name in NAMES), (NAMES[1], {"LC_ALL": "C.UTF-8"})]
QUICK = (*PICTURE, *SHORT, "--progress", "none")
# Prints from C, by Python's warnings, and by itself.
CHATTER = """
import os, sys, warnings
from precompute.cli import program
def main(packages):
    os.write(1, b"TIFFReadDirectory: Warning\\n")
    os.write(2, b"EXR_ERR_BAD_CHUNK_LEADER\\n")
    warnings.warn("overflow encountered", RuntimeWarning)
    print("ours")
    print("error: ours", file=sys.stderr)
    return 3
program.main = main
sys.exit(program.run())
"""


def run(*line, stdout=subprocess.PIPE, **settings):
    variables = settings.pop("variables", {})
    line = [each if isinstance(each, bytes) else str(each) for each in line]
    return subprocess.run(line, env=project_environment(**variables), stdout=stdout, stderr=subprocess.PIPE, **settings)


def test_what_libraries_print_is_not_shown():
    done = run(sys.executable, "-c", CHATTER)
    assert (done.returncode, done.stdout, done.stderr) == (3, b"ours\n", b"error: ours\n")


def test_a_damaged_tiff_is_told_in_one_line(tmp_path):
    path = tmp_path / "cut.tif"
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (64, 64), np.uint8)).save(path, compression="tiff_lzw")
    whole = bytearray(path.read_bytes())
    whole[8:200] = b"\xff" * 192
    path.write_bytes(whole)
    done = run(*PROGRAM, "info", path, *PICTURE)
    assert done.returncode == 1 and done.stdout == b""
    assert len(done.stderr.splitlines()) == 1 and done.stderr.startswith(f"error: {path}: ".encode())


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux has such file names and /dev/full")
class TestOnLinux:
    @pytest.mark.night("test_every_name_is_told_in_an_error")
    @pytest.mark.parametrize(("name", "variables"), TERMINALS)
    def test_every_name_is_read_written_and_told(self, scan, tmp_path, name, variables):
        named, out = os.path.join(os.fsencode(scan.parent), name), tmp_path / "out"
        os.rename(scan, named)
        for verb, options in {
            "info": (), "bake": (*LASER, "-o", out), "map": ("--size", "16", "-o", out / "map.exr"),
        }.items():  # fmt: skip
            quick = (*PICTURE, "--progress", "none") if verb == "info" else QUICK
            facts = tmp_path / "facts.json"
            done = run(*PROGRAM, verb, named, *quick, *options, "--json", facts, variables=variables)
            assert (done.returncode, done.stderr) == (0, b""), verb
            shown = done.stdout.decode("ascii" if variables is ASCII else "utf-8")
            assert all(line.isprintable() for line in shown.splitlines())
            assert "error: b" not in [line[:8] for line in shown.splitlines()]
            for file in json.loads(facts.read_text()).get("files", ()):
                decoded = file if variables is not ASCII else file.encode("ascii", "surrogateescape")
                assert os.path.isfile(decoded)

    @pytest.mark.short("variables1")
    @pytest.mark.parametrize(("name", "variables"), TERMINALS)
    def test_every_name_is_told_in_an_error(self, tmp_path, name, variables):
        path = os.path.join(os.fsencode(tmp_path), name)
        for line in (("info", path), ("map", path, "-o", b"/dev/null/" + name), ("info", b"sample:" + name),
                     ("info", b"sample:flat", b"--" + name), ("check", path, b"sample:flat")):  # fmt: skip
            done = run(*PROGRAM, *line, variables=variables)
            assert done.returncode in (1, 2) and done.stdout == b""
            told = done.stderr.decode("ascii" if variables is ASCII else "utf-8")
            assert told.startswith("error: ") and told.endswith("\n") and told[:-1].isprintable()

    @pytest.mark.night("test_facts_go_into_a_pipe")
    @pytest.mark.parametrize("target", ["-", "text"])
    def test_a_full_standard_output(self, scan, target):
        options = ("--json", "-") if target == "-" else ()
        with open("/dev/full", "wb") as full:
            done = run(*PROGRAM, "info", scan, *PICTURE, *options, stdout=full)
        assert done.returncode == 1
        told = b"error: standard output: cannot be written (No space left on device); send it elsewhere\n"
        assert done.stderr == told

    def test_a_full_file_of_facts(self, scan):
        done = run(*PROGRAM, "info", scan, *PICTURE, "--json", "/dev/full")
        assert done.returncode == 1 and done.stdout == b""
        assert done.stderr.startswith(b"error: /dev/full: cannot be written (No space left on device); ")
        assert Path("/dev/full").is_char_device()

    def test_facts_go_into_a_pipe(self, scan):
        line = f"{sys.executable} -m precompute info {scan} {' '.join(PICTURE)} --json /dev/fd/3 3>&1 >&2"
        done = run("sh", "-c", line)
        assert json.loads(done.stdout)["rows"] == 48 and b"rows: 48" in done.stderr

    def test_closed_streams_are_no_fault(self, scan):
        line = f"{sys.executable} -m precompute info {scan} {' '.join(PICTURE)}"
        assert run("sh", "-c", f"{line} >&- 2>&-").returncode == 0

    def test_an_output_that_nobody_reads_on(self, scan):
        line = f"{sys.executable} -m precompute info {scan} {' '.join(PICTURE)} | true"
        assert run("sh", "-c", line).stderr == b""

    @pytest.mark.night("tests/precompute/test_faults.py")
    @pytest.mark.parametrize("cache", ["--no-cache", "--model=ensemble"])
    def test_a_bake_that_the_disk_cannot_hold(self, scan, tmp_path, cache_folder, cache):
        """The system refuses files of more than 30 KB, which is less than any bake. Only the scan is left."""
        limited = "import resource, runpy; resource.setrlimit(resource.RLIMIT_FSIZE, (30000, 30000)); "
        limited += "runpy.run_module('precompute', run_name='__main__', alter_sys=True)"
        out = tmp_path / "out"
        done = run(sys.executable, "-c", limited, "bake", scan, *QUICK, *LASER, "-o", out, cache)
        assert done.returncode == 1 and done.stdout == b""
        assert done.stderr.startswith(f"error: {out / 'skin.exr'}: cannot be written (File too large); ".encode())
        assert len(done.stderr.splitlines()) == 1
        assert [path for path in tmp_path.rglob("*") if path.is_file()] == [scan]
        assert list(cache_folder.glob("*/*/*")) == []
