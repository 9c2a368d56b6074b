# SPDX-License-Identifier: GPL-3.0-or-later
"""Complex refractive indices n + ik of metals in visible light.

metals.csv holds the published values and names their sources in its header: McPeak et al. 2015 for aluminium, silver,
gold and copper, Johnson and Christy 1974 for chromium, nickel and titanium. n and k are interpolated linearly in
wavelength between the published values, which are 5 to 10 nm apart in the first four tables and 15 to 65 nm apart in
the others.
"""

from functools import cache
from pathlib import Path

import numpy as np

METALS = ("aluminium", "silver", "gold", "copper", "chromium", "nickel", "titanium")


@cache
def _tables() -> dict[str, np.ndarray]:
    """Each metal's table (m, 3): wavelength in nanometres, ascending; n; k."""
    lines = Path(__file__).with_name("metals.csv").read_text(encoding="ascii").splitlines()
    rows = [line.split(",") for line in lines if not line.startswith("#")]
    return {metal: np.array([row[1:] for row in rows if row[0] == metal], dtype=float) for metal in METALS}


def metal_index(metal: str, wavelengths_m: np.ndarray) -> np.ndarray:
    """The complex refractive index n + ik (n,) of one of METALS at wavelengths (n,) in metres.

    Raises ValueError if a wavelength is outside the metal's table. Every table covers 380 to 780 nm."""
    table = _tables()[metal]
    nm = np.asarray(wavelengths_m, dtype=float) * 1e9
    if not np.all((nm >= table[0, 0]) & (nm <= table[-1, 0])):
        raise ValueError(f"{metal}: give wavelengths from {table[0, 0]:g} to {table[-1, 0]:g} nm")
    return np.interp(nm, table[:, 0], table[:, 1]) + 1j * np.interp(nm, table[:, 0], table[:, 2])
