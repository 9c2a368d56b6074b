# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's algorithms evaluated in every pixel, in Open Shading Language (Cycles on the CPU): a reference.

| socket         | symbol | unit    | meaning |
|----------------|--------|---------|---------|
| Normal         | N      |         | unit shading normal |
| Tangent        | T      |         | unit, orthogonal to N, along the scan's x axis  |
| To Light       | wi     |         | unit vector to the lamp |
| Irradiance     | E      | W/m2    | on a surface that faces the lamp, linear RGB |
| IOR            | n      |         | of the skin |
| Finer (out)    | Lo     | W/m2/sr | linear RGB of the scene |

The formula is Stam's (see radiance.osl). The zero order is not separated and has the same obliquity, as in precompute's
comparison of the methods (brdf_map.from_method).

A shader's source is joined from the .osl files of this folder after a list of constants, so a .blend contains all of
it. The images stay a separate file, whose path is in the source: Blender 5.2 requires constant texture names."""

from pathlib import Path

import numpy as np

from ....precompute.colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, observer, spectral_weights, wavelengths
from ....precompute.methods.dft_layout import Layout, read_layout
from ....precompute.methods.nmm import specular_radius
from ..response import IOR, IRRADIANCE, NORMAL, TANGENT, TO_LIGHT, Response
from .script import colours, file_name, joined, script_group

# Micrometres per metre. The shaders use micrometres, which suit single precision better.
_UM = 1e6
_OBSERVER_STEP_M = 1e-9
_INPUTS = (NORMAL, TANGENT, TO_LIGHT, IRRADIANCE, IOR)


def build_osl_response(name: str, images_path: Path, rgb_from_xyz: np.ndarray) -> Response:
    """The response by the method of a file of images (`precompute dft`); rgb_from_xyz (3, 3) converts to the scene's
    linear space. Raises GratingError if the file holds no images, or if the shader does not compile, as without OSL."""
    layout = read_layout(images_path)
    return script_group(f"{layout.method.upper()} {name}", shader_text(layout, images_path, rgb_from_xyz), _INPUTS)


def shader_text(layout: Layout, images_path: Path, rgb_from_xyz: np.ndarray) -> str:
    """The complete source of the shader for a layout."""
    window = "pq" if layout.method == "pq" else "window"
    parts = [
        window,
        layout.expansion,
        "images",
        "flss",
        *(["nmm"] if layout.period_m else []),
        "fresnel",
        "gamut",
        "radiance",
    ]
    return joined(_constants(layout, images_path, rgb_from_xyz), parts)


def _constants(layout: Layout, images_path: Path, rgb_from_xyz: np.ndarray) -> dict[str, object]:
    lambdas = wavelengths(layout.step_m)
    table = np.arange(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M + _OBSERVER_STEP_M / 2, _OBSERVER_STEP_M)
    values = {
        "IMAGES": file_name(images_path),
        "WIDTH": float(layout.width),
        "HEIGHT": float(layout.height),
        "TILES_ACROSS": layout.columns,
        "TILE_ROWS": layout.tile_rows,
        "TILE_COLUMNS": layout.tile_columns,
        "TERMS": layout.terms,
        "REACH": layout.texels // 2,
        "LENGTH_U": layout.length_u_m * _UM,
        "LENGTH_V": layout.length_v_m * _UM,
        "ORIGIN_U": layout.tile_columns // 2,
        "ORIGIN_V": layout.tile_rows // 2,
        "SCALE": layout.scale_m * _UM,
        "POWER": layout.power * _UM**2,
        "SIGMA_F": layout.sigma_f / _UM,
        "COPIES_U": layout.copies_u,
        "COPIES_V": layout.copies_v,
        "FIRST_WAVELENGTH": WAVELENGTH_MIN_M * _UM,
        "LAST_WAVELENGTH": WAVELENGTH_MAX_M * _UM,
        "STEP": float(lambdas[1] - lambdas[0]) * _UM,
        "SAMPLES": len(lambdas),
        "WEIGHTS": colours(spectral_weights(lambdas, layout.illuminant) @ np.transpose(rgb_from_xyz)),
        "LUMINANCE": "vector({:.8g}, {:.8g}, {:.8g})".format(*np.linalg.inv(rgb_from_xyz)[1]),
        "RESPONSE": "grating_wavelengths" if layout.period_m else "all_wavelengths",
    }
    if layout.period_m:
        values |= {
            "PERIOD": layout.period_m * _UM,
            "SPECULAR": specular_radius(layout.sigma_f),
            "JACOBIAN": int(layout.method == "nmm-jacobian"),
            "OBSERVER_STEP": _OBSERVER_STEP_M * _UM,
            "OBSERVER_SAMPLES": len(table),
            "OBSERVER": colours(observer(table, layout.illuminant) @ np.transpose(rgb_from_xyz) / _UM),
        }
    return values
