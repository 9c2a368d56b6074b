# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing a file whole or not at all."""

import os
from collections.abc import Callable
from pathlib import Path


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Call `write` with a temporary path in the folder of `path`, then rename the file to `path`.

    Where `write` raises, the temporary file is removed, and a file that was at `path` stays as it was."""
    temporary = path.with_name(f".{path.stem}.partial{path.suffix}")
    try:
        write(temporary)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def can_be_a_path(text: str) -> bool:
    """Whether a text, such as one out of a file of JSON, can name a file: the system refuses a zero byte and halves of
    characters."""
    try:
        os.fsencode(text)
    except UnicodeEncodeError:
        return False
    return bool(text) and "\0" not in text
