# SPDX-License-Identifier: GPL-3.0-or-later
"""Packages bundled with the extension: OpenEXR, Pillow and xatlas.

`bundled` imports each only when it is needed, so the rest works without it. A package may be missing or broken: from
another platform's zip, or built for a newer system."""

import importlib
import importlib.util
import sys
from types import ModuleType

from .failure import GratingError

# The names under which the bundled packages are imported, and their common names.
_NAMES = {"OpenEXR": "OpenEXR", "PIL": "Pillow", "xatlas": "xatlas"}
_REMEDY = "install the extension's zip for this platform, or this package for this Python"


def missing_packages() -> list[str]:
    """The common names of the bundled packages that are missing. Loads none of them, since a panel asks at every
    redraw."""
    return [name for package, name in _NAMES.items() if importlib.util.find_spec(package) is None]


def bundled(module: str, remedy: str = _REMEDY) -> ModuleType:
    """Import a module of a bundled package.

    Raises GratingError "PACKAGE: fault; REMEDY" if the package is missing or its import raises any error."""
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
