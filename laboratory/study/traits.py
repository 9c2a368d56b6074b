# SPDX-License-Identifier: GPL-3.0-or-later
"""What the laboratory knows of each method: how it is drawn, and what it can be compared by."""

from dataclasses import dataclass

from precompute.methods.method_registry import ENTRIES


@dataclass(frozen=True)
class Traits:
    """Of one method.

    colour, marker   matplotlib's names, for the method's points in a plot
    first            whether it stands at the head of a legend
    is_reference     whether it is the exact answer of its model of coherence, which takes long
    has_spectrum     whether it has a density at each wavelength; a method without spectrum has colours alone
    has_units        whether its brightness means anything; if not, the benchmark fits it to the reference
    by_default       whether `evaluate` takes it if no methods are named
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
