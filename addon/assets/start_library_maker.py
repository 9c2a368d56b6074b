# SPDX-License-Identifier: GPL-3.0-or-later
"""The script that the second Blender runs first: `start_library_maker.py REQUEST`. It registers this extension's own
add-on, because the extension is not enabled there."""

import importlib
import json
import os
import sys
from pathlib import Path
from types import ModuleType

import bpy

ROOT = Path(__file__).resolve().parents[2]
NAME = "natural_gratings"


def main() -> None:
    request = Path(sys.argv[-1])
    sys.path.extend(json.loads(request.read_text(encoding="utf-8"))["packages"])
    package = sys.modules[NAME] = ModuleType(NAME)
    package.__path__ = [str(ROOT)]
    importlib.import_module(f"{NAME}.addon").register()
    maker = importlib.import_module(f"{NAME}.addon.assets.library_maker")
    failure = importlib.import_module(f"{NAME}.precompute.base.failure")
    failure_line = importlib.import_module(f"{NAME}.precompute.base.strict")
    try:
        maker.write_assets(request)
    except failure.GratingError as error:
        print(failure_line.failure_line(error), file=sys.stderr)
        _end(1)
    _end(0)


def _end(status: int) -> None:
    """End the process. As a Python module, Blender 4.5 may wait for ever at exit for the thread that closes its sound
    device."""
    sys.stdout.flush()
    sys.stderr.flush()
    if not bpy.app.binary_path:
        os._exit(status)
    sys.exit(status)


if __name__ == "__main__":
    main()
