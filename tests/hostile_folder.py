# SPDX-License-Identifier: GPL-3.0-or-later
"""A hostile folder, as it may come with a scan or a .blend: it holds Python files that must not run."""

from pathlib import Path

# Modules that every Python, NumPy's users and `-m precompute` import early.
MODULES = ("json", "numpy", "signal", "sitecustomize", "usercustomize", "PIL", "OpenEXR")
PACKAGES = ("precompute", "sample_scenes", "laboratory", "pip", "ruff")
_TRAP = "import os\nopen({mark!r}, 'w').close()\nraise SystemExit('the working folder was run')\n"


def set_traps(folder: Path) -> Path:
    """Fill a folder with trap modules; return the path of a file that exists once any of them has run."""
    mark = folder / "it was run"
    for name in MODULES:
        (folder / f"{name}.py").write_text(_TRAP.format(mark=str(mark)))
    for name in PACKAGES:
        (folder / name).mkdir()
        for file in ("__init__.py", "__main__.py"):
            (folder / name / file).write_text(_TRAP.format(mark=str(mark)))
    return mark
