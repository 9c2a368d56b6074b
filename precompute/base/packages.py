# SPDX-License-Identifier: GPL-3.0-or-later
"""The packages that the extension brings with it: OpenEXR, Pillow and xatlas.

Each is imported where it is used, by `bundled`, so that the rest works without it. A package may be missing, or be
there and broken: from the zip of another platform, or built for a newer system."""

import importlib
import sys
from types import ModuleType

from .failure import GratingError

# The names by which people know packages, where they are not those that are imported.
_NAMES = {"PIL": "Pillow"}
_REMEDY = "install the extension's zip for this platform again"


def bundled(module: str, remedy: str = _REMEDY) -> ModuleType:
    """A module of a package that the extension brings.

    Raises GratingError "PACKAGE: fault; REMEDY" if the package is missing, or fails as it is imported, however it
    fails."""
    package = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except Exception as error:
        name = _NAMES.get(package, package)
        version = ".".join(map(str, sys.version_info[:2]))
        if isinstance(error, ModuleNotFoundError) and (error.name or "").partition(".")[0] == package:
            raise GratingError(name, f"there is none for Python {version}", remedy) from error
        fault = f"{type(error).__name__}: {error}"
        raise GratingError(name, f"cannot be loaded ({fault:.300})", remedy) from error
