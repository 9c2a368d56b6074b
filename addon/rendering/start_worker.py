# SPDX-License-Identifier: GPL-3.0-or-later
"""The script that a worker of a farm runs, from the bundle of its job or from the extension's folder:

    blender --background --factory-startup --python start_worker.py --
        PLAN.json [--task N] [--per-task K] [--threads N] [--again] [--openjd]

The extension is not enabled there, and only the modules that worker.py imports are loaded. Nothing imports this
file."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
NAME = "natural_gratings"


def main() -> None:
    # Empty packages in place of the real ones: the add-on's __init__ would import the whole interface.
    for name, folder in ((NAME, ROOT), (f"{NAME}.addon", ROOT / "addon")):
        package = sys.modules[name] = ModuleType(name)
        package.__path__ = [str(folder)]
    worker = importlib.import_module(f"{NAME}.addon.rendering.worker")
    sys.exit(worker.main(sys.argv[sys.argv.index("--") + 1 :]))


if __name__ == "__main__":
    main()
