# SPDX-License-Identifier: GPL-3.0-or-later
"""A virtual screen for a Blender with a window."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .. import DevError


@contextmanager
def display(width: int = 1280, height: int = 900, *, folder: Path | None = None) -> Iterator[str]:
    """A virtual screen; yields its name for DISPLAY. The file Xvfb_screen0 in `folder` always holds its picture, in the
    xwd format. Raises DevError if there is no Xvfb."""
    if shutil.which("Xvfb") is None:
        raise DevError("Xvfb is missing; remedy: apt-get install xvfb")
    reader, writer = os.pipe()
    screen = ["Xvfb", "-displayfd", str(writer), "-screen", "0", f"{width}x{height}x24", "-nolisten", "tcp"]
    screen += ["-fbdir", str(folder)] if folder else []
    server = subprocess.Popen(screen, pass_fds=[writer], stderr=subprocess.DEVNULL)
    try:
        os.close(writer)
        with os.fdopen(reader) as answer:
            number = answer.readline().strip()
        if not number:
            raise DevError("Xvfb did not start; remedy: run Xvfb by hand and read what it says")
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()
