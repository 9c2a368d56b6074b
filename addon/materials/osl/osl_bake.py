# SPDX-License-Identifier: GPL-3.0-or-later
"""The Direct group's formula (direct/direct_group.py) in Open Shading Language, for Cycles on the CPU.

It has the Direct group's inputs and one output, the mix of both blur levels. The positions of the levels' tiles are
arrays in the shader, one number per level, so the shader does not need the layout rule of table.py. The bake stays a
separate file (see thesis_methods.py). Blender versions flip it differently; the shader detects this by one texel."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ....precompute.base.exr_reader import open_picture
from ....precompute.optics.brdf import IOR_MAX
from ....precompute.optics.mirror_image import EDGE, ENDS, LEAST_Q, LEAST_VARIANCE
from ....precompute.table.atlas import STRIP_ROWS, Layout
from ....precompute.table.blur_levels import TILE_PADDING
from ....precompute.table.plate_gains import disc_texel
from ..response import QUESTION, Response
from .script import colours, file_name, joined, script_group


def build_osl_direct(name: str, bake_path: Path, layout: Layout, *, rgb_from_xyz: np.ndarray) -> Response:
    """The response of a bake's file as a shader; rgb_from_xyz (3, 3) converts to the scene's linear space.

    Raises GratingError, and leaves nothing behind, if the file cannot be read or the shader does not compile."""
    text = joined(_constants(bake_path, layout, rgb_from_xyz), ("fresnel", "small_slope", "gamut", "direct"))
    return script_group(f"Direct {name}", text, QUESTION)


def _constants(bake_path: Path, layout: Layout, rgb_from_xyz: np.ndarray) -> dict[str, object]:
    (u_low, u_high), (v_low, v_high) = layout.region
    levels = range(layout.levels)
    firsts = [layout.tile_origin(0, level) for level in levels]
    return {
        "ATLAS": file_name(bake_path),
        "WIDTH": float(layout.width),
        "HEIGHT": float(layout.height),
        "TERMS": layout.terms,
        "POLYNOMIALS": layout.polynomials,
        "COEFFICIENTS": len(layout.basis),
        "BASIS": _listed(layout.basis),
        "COLUMNS": layout.columns,
        "SCALE": layout.scale,
        "U_LOW": u_low,
        "U_HIGH": u_high,
        "V_LOW": v_low,
        "V_HIGH": v_high,
        "W_MIN": layout.w_min,
        "W_MAX": layout.w_max,
        "SIGMA_B2": layout.sigma_b**2,
        "LEVELS": layout.levels,
        "LEVEL_VARIANCES": _listed(layout.sigma_b**2 * layout.spacing.grown(level) for level in levels),
        "LEVEL_TEXELS": _listed(layout.texel * layout.cell.texels(level) for level in levels),
        "LEVEL_FIRSTS_X": _listed(x + TILE_PADDING for x, _ in firsts),
        "LEVEL_FIRSTS_Y": _listed(y + TILE_PADDING for _, y in firsts),
        "CELL_COLUMNS": layout.cell_columns,
        "CELL_ROWS": layout.cell_rows,
        # The middle row of the strip; all its rows hold the same values.
        "ZERO_ORDER_Y": (STRIP_ROWS - 1) / 2,
        "ZERO_ORDER_SAMPLES": layout.zero_order_samples,
        "HOLDS_REFLECTANCE": int(layout.holds_reflectance),
        "IOR_MAX": IOR_MAX,
        "RATIO_IOR": layout.ratio_ior,
        "LEAST_VARIANCE": LEAST_VARIANCE,
        "EDGE": EDGE,
        "LEAST_Q": LEAST_Q,
        "ENDS": ENDS,
        "PLATE_IOR": layout.plate_ior,
        # The positions of the normal in the tables of a plate's gains.
        "GAIN_X": (layout.gain_texels - 1) / 2,
        "GAIN_Y": layout.strip_rows - (layout.gain_texels + 1) / 2,
        "GAIN_TEXELS": layout.gain_texels,
        "GAIN_TEXEL": disc_texel(layout.gain_texels) if layout.gain_texels else 1.0,
        "FARTHEST2": layout.farthest**2,
        "RGB_COLUMNS": colours(np.transpose(rgb_from_xyz)),
        **_mark(bake_path),
    }


def _mark(bake_path: Path) -> dict[str, float]:
    """The texel by which the shader detects which way up it reads the picture: its green exceeds the green at its place
    in the flipped picture the most. MARK is the mean of the two."""
    green = open_picture(bake_path).pixels()[..., 1].astype(np.float32)
    turned = green[::-1]
    y, x = np.unravel_index(np.argmax(green - turned), green.shape)
    return {"MARK_X": float(x), "MARK_Y": float(y), "MARK": float(green[y, x] + turned[y, x]) / 2}


def _listed(values: Iterable[float]) -> str:
    return ", ".join(str(float(value)) for value in values)
