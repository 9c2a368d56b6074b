# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes precompute/colour/cie_illuminants_5nm.csv from colour-science:
`python devtools/tables/generate_illuminant_table.py`."""

from pathlib import Path

import colour
import numpy as np
from colour.colorimetry import SDS_BASIS_FUNCTIONS_CIE_ILLUMINANT_D_SERIES

WAVELENGTHS_NM = np.arange(380, 781, 5)
TABLE = Path(__file__).parents[2] / "precompute" / "colour" / "cie_illuminants_5nm.csv"
NAMES = (
    "C",
    *(f"FL{k}" for k in range(1, 13)),
    *(f"HP{k}" for k in range(1, 6)),
    *("LED-B1", "LED-B2", "LED-B3", "LED-B4", "LED-B5", "LED-BH1", "LED-RGB1", "LED-V1", "LED-V2"),
)
# The mean of daylight and its two changes, of which CIE 15 composes daylight of any colour temperature.
DAYLIGHT = ("S0", "S1", "S2")
HEADER = (
    "CIE illuminants (CIE 15:2018, 5 nm) and the components S0, S1 and S2 of daylight, generated from\n"
    "colour-science by devtools/tables/generate_illuminant_table.py\n"
    f"wavelength_nm,{','.join((*NAMES, *DAYLIGHT))}"
)


def table() -> np.ndarray:
    """Rows (81, n): the wavelength in nanometres, the power of each of NAMES, and each of DAYLIGHT."""
    known = {**colour.SDS_ILLUMINANTS, **SDS_BASIS_FUNCTIONS_CIE_ILLUMINANT_D_SERIES}
    columns = [[known[name][float(nm)] for nm in WAVELENGTHS_NM] for name in (*NAMES, *DAYLIGHT)]
    return np.column_stack([WAVELENGTHS_NM, *columns])


if __name__ == "__main__":
    np.savetxt(TABLE, table(), fmt="%.8g", delimiter=",", header=HEADER)
