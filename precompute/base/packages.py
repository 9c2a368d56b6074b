# SPDX-License-Identifier: GPL-3.0-or-later
"""Packages bundled with the extension: OpenEXR, Pillow and xatlas.

`bundled` imports each only when it is needed, so the rest works without it. A package may be missing or broken: from
another platform's zip, or built for a newer system."""

import importlib
import sys
from types import ModuleType

from .failure import GratingError

# Common names of packages whose import name differs.
_NAMES = {"PIL": "Pillow"}
_REMEDY = "install the extension's zip for this platform again"


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
