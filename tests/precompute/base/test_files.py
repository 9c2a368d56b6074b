# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing files whole or not at all: links, permissions, full disks, and leftovers of a job. And reading with a
limit."""

import errno
import os
import shutil
import stat
from functools import partial
from pathlib import Path

import pytest

from precompute.base.failure import GratingError
from precompute.base.files import partial_folder, read_limited, short_stem, told_of, write_together, write_whole
from precompute.base.job import JOB_VARIABLE


def test_a_link_in_the_way_is_not_followed(tmp_path):
    """Links at the path itself and at names that were once used for unfinished files."""
    victim, path = tmp_path / "victim", tmp_path / "map.png"
    victim.write_text("mine")
    for name in ("map.png", ".map.partial.png", f".map.{os.getpid()}.partial.exr", ".map.partial", ".grating.partial"):
        (tmp_path / name).symlink_to(victim)
    write_whole(path, lambda partial: partial.write_text("new"))
    assert victim.read_text() == "mine"
    assert path.read_text() == "new" and not path.is_symlink()


def test_names_of_files_in_the_making_cannot_be_guessed(tmp_path):
    """Only the owner may enter the folder of unfinished files."""
    seen = []
    for _ in range(2):
        with partial_folder(tmp_path) as folder:
            seen.append(folder)
            assert stat.S_IMODE(folder.stat().st_mode) == 0o700
            with pytest.raises(FileExistsError):
                folder.mkdir()
    assert seen[0] != seen[1] and os.listdir(tmp_path) == []


@pytest.mark.skipif(os.name != "posix", reason="permissions of this kind are POSIX's")
@pytest.mark.parametrize("umask", [0o022, 0o077, 0o002])
def test_a_file_has_the_permissions_of_any_new_file(tmp_path, umask):
    before = os.umask(umask)
    try:
        write_whole(tmp_path / "facts.json", lambda partial: partial.write_text("{}"))
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "facts.json").stat().st_mode) == 0o666 & ~umask


def test_a_writer_sees_the_file_s_own_name(tmp_path):
    """Libraries choose the format by the name's extension."""
    write_whole(tmp_path / "map.png", lambda partial: partial.write_text(partial.name))
    assert (tmp_path / "map.png").read_text() == "map.png"


@pytest.mark.parametrize("fault", [OSError(errno.ENOSPC, "No space left on device"), ValueError(), KeyboardInterrupt()])
def test_a_writer_that_fails_leaves_all_as_it_was(tmp_path, fault):
    old, new = tmp_path / "old", tmp_path / "new"
    old.write_text("old")

    def fail(partial):
        partial.write_text("half")
        raise fault

    expected = GratingError if isinstance(fault, OSError) else type(fault)
    with pytest.raises(expected) as caught:
        write_together({old: lambda partial: partial.write_text("other"), new: fail})
    assert os.listdir(tmp_path) == ["old"] and old.read_text() == "old"
    if expected is GratingError:
        assert str(caught.value).startswith(f"{new}: cannot be written (No space left on device); check its folder")


def test_a_folder_that_is_not_there_is_told_by_the_file(tmp_path):
    with pytest.raises(GratingError, match=r"gone/a\.png: cannot be written \(No such file or directory\); "):
        write_whole(tmp_path / "gone" / "a.png", Path.touch)


def test_partial_folders_are_not_told(tmp_path):
    with (
        partial_folder(tmp_path, "bake.0123") as outer,
        pytest.raises(GratingError) as caught,
    ):
        write_whole(outer / "gone.exr" / "a.exr", Path.touch)
    assert str(caught.value).startswith(f"{tmp_path / 'gone.exr' / 'a.exr'}: ")


def test_what_a_job_leaves_is_found_by_its_name(tmp_path, monkeypatch):
    monkeypatch.setenv(JOB_VARIABLE, str(tmp_path / "natural-gratings-x_1"))
    with partial_folder(tmp_path, "bake.0123"):
        assert len(list(tmp_path.glob(".*.natural-gratings-x_1.partial"))) == 1


def test_one_byte_more_than_the_limit_is_read(tmp_path):
    """So a caller sees that a file is too large, and reads no more of it."""
    path = tmp_path / "data"
    for count, expected in ((0, 0), (9, 9), (10, 10), (11, 11), (12, 11), (10**5, 11)):
        path.write_bytes(b"x" * count)
        assert len(read_limited(path, 10, "give less")) == expected


@pytest.mark.parametrize(("name", "told"), [
    ("gone", "cannot be read (No such file or directory); give a file"), ("folder", "is not a file; give a file"),
    ("fifo", "is not a file"), ("x" * 300, "cannot be read"), ("a\0b", "cannot be read"),
])  # fmt: skip
def test_what_cannot_be_read_is_told_in_a_line(tmp_path, name, told):
    (tmp_path / "folder").mkdir()
    if name == "fifo":
        if not hasattr(os, "mkfifo"):
            pytest.skip("fifos are POSIX's")
        os.mkfifo(tmp_path / "fifo")
    with pytest.raises(GratingError) as error:
        read_limited(tmp_path / name, 10, "give a file")
    assert told in str(error.value) and str(error.value).isprintable()


@pytest.mark.parametrize("letter", ["x", "\u00e4", "\U0001f308", "\udcff"])
def test_a_long_name_is_shortened_and_stays_its_own(letter):
    """With any ending of up to 55 bytes the name fits into the 255 bytes of a file system."""
    one, other = (short_stem(letter * 250 + end) for end in "ab")
    assert one != other and one == short_stem(letter * 250 + "a")
    assert len(one.encode()) <= 200 and set(one.partition("_")[0]) <= {letter}
    assert short_stem("skin" + letter) == "skin" + letter


def test_a_copy_s_source_is_blamed_for_its_own_fault(tmp_path):
    """A source that is missing, beside a folder that is missing, and a full disk, which names both files."""
    (tmp_path / "out").mkdir()
    missing, target = tmp_path / "in" / "a.exr", tmp_path / "out" / "b.exr"
    with pytest.raises(GratingError, match=r"in.a\.exr: cannot be read \(No such file"):
        write_whole(target, partial(shutil.copyfile, missing))
    with pytest.raises(GratingError, match=r"none.b\.exr: cannot be written \(No such file"):
        write_whole(tmp_path / "none" / "b.exr", Path.touch)
    with pytest.raises(GratingError, match=r"out.b\.exr: cannot be written \(full"), told_of(target):
        raise OSError(28, "full", str(missing), None, str(target))
