# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing files whole or not at all, where nobody else can reach what is half-written."""

import contextlib
import os
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from .failure import GratingError
from .job import job_name

# The names of partial folders.
_PARTIAL = re.compile(r"\..+\..{8}\.[^.]*\.partial", re.DOTALL)


@contextlib.contextmanager
def partial_folder(folder: Path, label: str = "grating") -> Iterator[Path]:
    """A new folder in `folder` for files in the making. It is removed in the end, with what is still in it.

    Its name, ".LABEL.RANDOM.JOB.partial", cannot be guessed, and only the user may enter it. So nothing can lie in wait
    at the path of a file in it, such as a link to a file that would be overwritten. By the job's name the program that
    started the job finds what is left where the job is killed. Raises OSError if the folder cannot be made."""
    name = {"prefix": f".{label}.", "suffix": f".{job_name()}.partial"}
    with tempfile.TemporaryDirectory(dir=folder, ignore_cleanup_errors=True, **name) as made:
        yield Path(made)


def write_together(writers: Mapping[Path, Callable[[Path], object]]) -> None:
    """Call each path's writer with a path of the same name in a partial folder, then rename all files to their paths.

    Where a writer fails, a file that was at any of the paths stays as it was. Raises GratingError, naming the path, if
    a file cannot be written."""
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
    """write_together for one file."""
    write_together({path: write})


@contextlib.contextmanager
def told_of(path: Path) -> Iterator[None]:
    """Within it, an OSError becomes a GratingError that says that `path` cannot be written, and why.

    Partial folders in the path are not told: they are gone by then."""
    try:
        yield
    except OSError as error:
        shown = Path(*(part for part in path.parts if not _PARTIAL.fullmatch(part)))
        raise GratingError(
            shown,
            f"cannot be written ({error.strerror or error})",
            "check its folder, the permissions, and the space left there",
        ) from error


def can_be_a_path(text: str) -> bool:
    """Whether a text, such as one out of a file of JSON, can name a file: the system refuses a zero byte and halves of
    characters."""
    try:
        os.fsencode(text)
    except UnicodeEncodeError:
        return False
    return bool(text) and "\0" not in text
