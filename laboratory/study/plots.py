# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads matplotlib for the plots of the command line. The extension does not ship it, so it may be absent."""

from importlib.machinery import PathFinder
from types import ModuleType

from precompute.base.failure import GratingError


def pyplot() -> ModuleType:
    """Return matplotlib.pyplot, set up to draw into files. Raises GratingError if matplotlib is not installed."""
    # Look only at the search path: without matplotlib, colour-science leaves a stand-in among the loaded modules.
    if PathFinder.find_spec("matplotlib") is None:
        raise GratingError("", "plots need matplotlib, which is not installed", "python -m pip install matplotlib")
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
