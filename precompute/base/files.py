# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes files atomically, and reads untrusted files up to a size.

A written file appears complete or not at all, and other users cannot reach a partial file."""

import contextlib
import hashlib
import os
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from .failure import GratingError
from .job import job_name

# Bytes of the longest stem that short_stem returns. File systems allow 255 bytes for the whole name.
_LONGEST_STEM = 200
_PARTIAL = re.compile(r"\..+\..{8}\.[^.]*\.partial", re.DOTALL)


def is_no_file(path: Path) -> bool:
    """Whether a path is there and names no file, such as a folder, or a fifo whose opening would block.

    Raises OSError or ValueError for a name that no path can have."""
    return path.exists() and not path.is_file()


def read_limited(path: Path, most_bytes: int, remedy: str) -> bytes:
    """Read a file, at most one byte more than most_bytes.

    Raises GratingError "PATH: fault; REMEDY" if it cannot be read."""
    try:
        if is_no_file(path):
            raise GratingError(path, "is not a file", remedy)
        with path.open("rb") as file:
            return file.read(most_bytes + 1)
    except (OSError, ValueError) as error:
        raise GratingError(path, f"cannot be read ({getattr(error, 'strerror', None) or error})", remedy) from error


@contextlib.contextmanager
def partial_folder(folder: Path, label: str = "grating") -> Iterator[Path]:
    """Make a temporary folder in `folder` for partial files, and remove it with its content at the end.

    Its name is ".LABEL.RANDOM.JOB.partial". Only the user may enter it, and its name cannot be guessed, so nobody can
    plant a link that would redirect a write. If the job is killed, the program that started it finds the folder by the
    job's name. Raises OSError if the folder cannot be made."""
    name = {"prefix": f".{label}.", "suffix": f".{job_name()}.partial"}
    with tempfile.TemporaryDirectory(dir=folder, ignore_cleanup_errors=True, **name) as made:
        yield Path(made)


def write_together(writers: Mapping[Path, Callable[[Path], object]]) -> None:
    """Call each path's writer with a path of the same name in a partial folder, then move all files into place.

    If a writer fails, all existing files stay unchanged. Raises GratingError if a file cannot be written."""
    with contextlib.ExitStack() as stack:
        partial = {}
        for path, write in writers.items():
            with told_of(path):
                partial[path] = stack.enter_context(partial_folder(path.parent)) / path.name
                write(partial[path])
        for path in writers:
            with told_of(path):
                partial[path].replace(path)


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Call write_together for one file."""
    write_together({path: write})


@contextlib.contextmanager
def told_of(path: Path) -> Iterator[None]:
    """Turn an OSError in the `with` block into a GratingError: `path` cannot be written, and why, or another file, such
    as the source of a copy, cannot be read.

    The message leaves out partial folders, which no longer exist."""
    try:
        yield
    except OSError as error:
        if _is_elsewhere(error, path.absolute()):
            fault = f"cannot be read ({error.strerror or error})"
            raise GratingError(str(error.filename), fault, "check the path and its permissions") from error
        shown = Path(*(part for part in path.parts if not _PARTIAL.fullmatch(part)))
        raise GratingError(
            shown,
            f"cannot be written ({error.strerror or error})",
            "check its folder, the permissions, and the space left there",
        ) from error


def _is_elsewhere(error: OSError, path: Path) -> bool:
    """Whether an error names a file alone that is neither in a path's folder nor a folder of it."""
    if not isinstance(error.filename, str) or error.filename2 is not None:
        return False
    named = Path(error.filename).absolute()
    return not named.is_relative_to(path.parent) and not path.is_relative_to(named)


def short_stem(stem: str) -> str:
    """A file's name without extension, shortened if it would leave no room for endings such as "_and_9_more.lobes.exr".

    A shortened name ends in a hash of the whole, so that two long names stay two."""
    raw = stem.encode(errors="surrogatepass")
    if len(raw) <= _LONGEST_STEM:
        return stem
    begin = raw[: _LONGEST_STEM - 9].decode(errors="ignore")
    return f"{begin}_{hashlib.sha256(raw).hexdigest()[:8]}"


def can_be_a_path(text: str) -> bool:
    """Whether a text, for example from JSON, can name a file. The system refuses zero bytes and lone surrogates."""
    try:
        os.fsencode(text)
    except UnicodeEncodeError:
        return False
    return bool(text) and "\0" not in text
