# SPDX-License-Identifier: GPL-3.0-or-later
"""The script that the second Blender runs first: `start_second_blender.py REQUEST`. The extension is not enabled there,
and only the modules that second_blender.py imports are loaded."""

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
    importlib.import_module(f"{NAME}.addon.worlds.second_blender").render_and_fit(Path(sys.argv[-1]))


if __name__ == "__main__":
    main()
