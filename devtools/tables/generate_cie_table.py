# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes precompute/colour/cie_1931_d65_1nm.csv from colour-science: `python devtools/tables/generate_cie_table.py`."""

from pathlib import Path

import colour
import numpy as np

WAVELENGTHS_NM = np.arange(380, 781)
TABLE = Path(__file__).parents[2] / "precompute" / "colour" / "cie_1931_d65_1nm.csv"
HEADER = (
    "CIE 1931 2 degree colour matching functions and CIE standard illuminant D65 (1 nm, linear interpolation\n"
    "of the 5 nm table as CIE 15 recommends), generated from colour-science by devtools/tables/generate_cie_table.py\n"
    "wavelength_nm,x_bar,y_bar,z_bar,d65"
)


def table() -> np.ndarray:
    """Rows (401, 5): wavelength in nanometres; x, y and z of the observer; D65."""
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    d65 = colour.SDS_ILLUMINANTS["D65"]
    values = np.array([cmfs[float(nm)] for nm in WAVELENGTHS_NM])
    power = np.interp(WAVELENGTHS_NM, d65.wavelengths, d65.values)
    return np.column_stack([WAVELENGTHS_NM, values, power])


if __name__ == "__main__":
    np.savetxt(TABLE, table(), fmt=["%d", "%.12g", "%.12g", "%.12g", "%.8g"], delimiter=",", header=HEADER)
