# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing a file whole or not at all."""

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
