# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes oracle.json: what the package SurfaceTopography reads from the real files.

    python -m venv FOLDER && FOLDER/bin/pip install SurfaceTopography==1.27.1
    FOLDER/bin/python tests/precompute/surface/make_oracle.py ../shared/data

The package needs 40 others and half a gigabyte, so only its numbers are kept. Its arrays are (x, y) from the top left;
lengths are converted to metres."""

import json
import sys
from pathlib import Path

import numpy as np
from SurfaceTopography.IO import open_topography

# Files that the package cannot read are left out: gwyfile_test.gwy has no height; x3ptools_pyramid.x3p has a longer
# dash in its "ISO5436 - 2000" than the package expects; pictures, arrays, st_xyz-1.txt and the wave without units have
# no unit. In the package the y of points grows downwards, but in a right-handed (x, y, z) with z outward it grows
# upwards.
FILES = (
    "afmreader_sample_0.jpk", "afmreader_sample_0.jpk-qi-image", "afmreader_sample_0.top", "st_di-1.di", "st_di-3.di",
    "st_example_ps.tiff", "st_gwyddion-export-english.txt", "st_gwyddion-export-german.txt", "st_matrix-3.txt",
    "st_matrix-6.txt", "st_mi-1.mi", "st_nid-1.nid", "st_sdf-1.sdf", "st_spot_1-1000nm.ibw", "st_stp-1.stp",
    "st_sur-2.sur", "st_sur-3.sur", "st_x3p-2.x3p", "grid.gwy", "grid.nid", "grid_gwyddion.txt",
)  # fmt: skip
METRES = {"m": 1.0, "mm": 1e-3, "\u00b5m": 1e-6, "nm": 1e-9}


def facts(path: Path) -> dict[str, object]:
    """Shape, sides, missing points, range, rms and corners of the package's default channel."""
    topography = open_topography(str(path)).topography()
    unit = METRES[topography.unit]
    height = np.ma.filled(topography.heights().astype(float), np.nan).T * unit
    corners = [height[row, col] for row in (0, -1) for col in (0, -1)]
    return {
        "shape": height.shape,
        "size_m": [float(side) * unit for side in topography.physical_sizes[::-1]],
        "missing": int(np.isnan(height).sum()),
        "lowest": float(np.nanmin(height)),
        "highest": float(np.nanmax(height)),
        "rms": float(np.nanstd(height)),
        "corners": [None if np.isnan(corner) else float(corner) for corner in corners],
    }


if __name__ == "__main__":
    found = {name: facts(next(Path(sys.argv[1]).rglob(name))) for name in FILES}
    table = Path(__file__).with_name("oracle.json")
    table.write_text(json.dumps(found, indent=1) + "\n")
