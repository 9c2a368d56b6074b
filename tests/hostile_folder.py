# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder as anyone may hand it on beside a scan or a .blend: Python that nobody asked for lies in it."""

from pathlib import Path

# Imported early by every Python, by NumPy's users, and by `-m precompute`.
MODULES = ("json", "numpy", "signal", "sitecustomize", "usercustomize", "PIL", "OpenEXR")
PACKAGES = ("precompute", "sample_scenes", "laboratory", "pip", "ruff")
_TRAP = "import os\nopen({mark!r}, 'w').close()\nraise SystemExit('the working folder was run')\n"


def set_traps(folder: Path) -> Path:
    """Put the Python into a folder; the path of a file that is there as soon as any of it has run."""
    mark = folder / "it was run"
    for name in MODULES:
        (folder / f"{name}.py").write_text(_TRAP.format(mark=str(mark)))
    for name in PACKAGES:
        (folder / name).mkdir()
        for file in ("__init__.py", "__main__.py"):
            (folder / name / file).write_text(_TRAP.format(mark=str(mark)))
    return mark
