# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes precompute/reflectance/metals.csv: `python devtools/tables/generate_metal_table.py DATABASE`.

DATABASE is the folder of a clone of github.com/polyanskiy/refractiveindex.info-database, which is in the public domain
(CC0 1.0)."""

import sys
from pathlib import Path

TABLE = Path(__file__).parents[2] / "precompute" / "reflectance" / "metals.csv"
RANGE_NM = (380, 780)
# The file of each metal in the database.
FILES = {
    "aluminium": "Al/nk/McPeak.yml",
    "silver": "Ag/nk/McPeak.yml",
    "gold": "Au/nk/McPeak.yml",
    "copper": "Cu/nk/McPeak.yml",
    "chromium": "Cr/nk/Johnson.yml",
    "nickel": "Ni/nk/Johnson.yml",
    "titanium": "Ti/nk/Johnson.yml",
}
HEADER = """\
# Complex refractive index n + ik of metals at room temperature, as published, from the refractiveindex.info database
# (M. N. Polyanskiy, public domain, CC0 1.0), written by devtools/tables/generate_metal_table.py
# aluminium, silver, gold, copper: K. M. McPeak et al., ACS Photonics 2, 326-333 (2015); evaporated, template stripped
# chromium, nickel, titanium: P. B. Johnson and R. W. Christy, Phys. Rev. B 9, 5056-5070 (1974)
# metal,wavelength_nm,n,k
"""


def rows(database: Path, metal: str) -> list[str]:
    """A metal's published rows from the last below 380 nm to the first above 780 nm."""
    text = (database / "database" / "data" / "main" / FILES[metal]).read_text(encoding="utf-8")
    _, _, table = text.partition("- type: tabulated nk\n    data: |\n")
    published = [line.split() for line in table.splitlines() if line.startswith("        ")]
    nm = [float(row[0]) * 1000 for row in published]
    first = max(i for i, each in enumerate(nm) if each < RANGE_NM[0])
    last = min(i for i, each in enumerate(nm) if each > RANGE_NM[1])
    return [f"{metal},{nm[i]:.8g},{published[i][1]},{published[i][2]}\n" for i in range(first, last + 1)]


if __name__ == "__main__":
    TABLE.write_text(HEADER + "".join(row for metal in FILES for row in rows(Path(sys.argv[1]), metal)), "ascii")
