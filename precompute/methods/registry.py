# SPDX-License-Identifier: GPL-3.0-or-later
"""Every way to evaluate the spectrum of a relief, in one shape: `METHODS[name](relief, settings)`.

A method is judged against the reference of its own coherence model: "reference" (ensemble) or "reference-patch".
"""

from collections.abc import Callable

from ..surface.relief import Relief
from . import baked, chebyshev_series, exact, flss, gem, nmm, pq, stam
from .method import Method, Settings

METHODS: dict[str, Callable[[Relief, Settings], Method]] = {
    "reference": exact.build_ensemble,
    "reference-patch": exact.build_patch,
    "flss": flss.build,
    "chebyshev": chebyshev_series.build,
    "nmm": nmm.build,
    "nmm-jacobian": nmm.build_jacobian,
    "pq": pq.build,
    "pq-printed": pq.build_printed,
    "stam": stam.build,
    "gem": gem.build,
    "bake": baked.build,
}
