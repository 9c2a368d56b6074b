# SPDX-License-Identifier: GPL-3.0-or-later
"""matplotlib, for the plots of the command line. It is no part of the extension and may be absent."""

from importlib.machinery import PathFinder
from types import ModuleType

from precompute.base.failure import GratingError


def pyplot() -> ModuleType:
    """matplotlib.pyplot, drawing into files. Raises GratingError where matplotlib is not installed."""
    # Only the search path tells: where matplotlib is absent, colour-science leaves a stand-in among the loaded modules.
    if PathFinder.find_spec("matplotlib") is None:
        raise GratingError("", "plots need matplotlib, which is not installed", "python -m pip install matplotlib")
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot
