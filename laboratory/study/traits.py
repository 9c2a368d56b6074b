# SPDX-License-Identifier: GPL-3.0-or-later
"""The laboratory's facts about each method: how it is drawn, and what can be compared."""

from dataclasses import dataclass

from precompute.methods.method_registry import ENTRIES


@dataclass(frozen=True)
class Traits:
    """Facts about one method.

    colour, marker   the method's colour and marker in plots, in matplotlib's names
    first            whether it comes first in a legend
    is_reference     whether it is the slow exact solution of its model of coherence
    has_spectrum     whether it has a density at each wavelength; otherwise it has only colours
    has_units        whether its brightness has a physical scale; otherwise the benchmark fits it to the reference
    by_default       whether `evaluate` includes it by default
    """

    colour: str
    marker: str
    first: bool = False
    is_reference: bool = False
    has_spectrum: bool = True
    has_units: bool = True
    by_default: bool = True


TRAITS = {
    "reference": Traits("k", "*", is_reference=True),
    "reference-patch": Traits("k", "*", is_reference=True),
    "flss": Traits("C3", "s"),
    "chebyshev": Traits("C1", "D"),
    "nmm": Traits("C2", "v"),
    "nmm-jacobian": Traits("C2", "^", by_default=False),
    "pq": Traits("C4", "P"),
    "pq-printed": Traits("C4", "X"),
    "stam": Traits("C5", "h"),
    "gem": Traits("C6", "d", has_spectrum=False, has_units=False, by_default=False),
    "bake": Traits("C0", "o", first=True, has_spectrum=False, by_default=False),
}
DEFAULT_METHODS = tuple(name for name in ENTRIES if TRAITS[name].by_default)
