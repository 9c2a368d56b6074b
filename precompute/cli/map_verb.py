# SPDX-License-Identifier: GPL-3.0-or-later
"""`map`: a BRDF map over the hemisphere of view."""

import argparse
from pathlib import Path

import numpy as np

from ..bake.ensemble import bake, plan
from ..bake.request import BakeRequest
from ..base.failure import GratingError, Setting
from ..base.files import write_whole
from ..base.packages import bundled
from ..maps import brdf_map
from ..methods import baked, exact
from ..methods.method import Settings
from ..methods.method_registry import MAP_METHODS, METHODS
from ..surface.relief import Relief, prepare
from ..table import atlas, atlas_file
from .arguments import (
    PERIOD_NM,
    STEP_NM,
    TERMS,
    add_input,
    coherence_argument,
    existing_bake,
    height_map_of,
    naming,
    period_of,
)
from .option_types import count, number, path_argument
from .printing import Progress, emit


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `map`."""
    add_input(parser)
    parser.add_argument("-o", "--output", required=True, type=path_argument, metavar="PNG|EXR")
    parser.add_argument("--method", choices=MAP_METHODS, default=baked.ENTRY.name)
    parser.add_argument(
        "--theta-i",
        type=number(-89.99, 89.99),
        default=0.0,
        metavar="DEG",
        help="angle of the light, from -x; default 0",
    )
    parser.add_argument("--step-nm", type=STEP_NM, default=5.0, metavar="NM", help="wavelength step; default 5")
    parser.add_argument(
        "--terms", type=TERMS, metavar="N", help="terms of Taylor or Chebyshev; default: by error bound"
    )
    parser.add_argument(
        "--precision", choices=("float32", "float64"), default="float32", help="of the terms of Taylor and Chebyshev"
    )
    parser.add_argument(
        "--centred", action="store_true", help="Taylor about the middle of the relief, not its lowest point"
    )
    parser.add_argument(
        "--period-nm", type=PERIOD_NM, metavar="NM", help="period of the grating (nmm, stam, gem); default: it is found"
    )
    parser.add_argument("--size", type=count(8, 8192), default=512, metavar="PIXELS")
    parser.add_argument("--coherence-um", type=coherence_argument, default=None, metavar="auto|UM")
    parser.add_argument(
        "--form",
        choices=("material", "stam"),
        default="material",
        help="form of the BRDF: that of the materials, or Stam's; the thesis's methods have Stam's",
    )
    parser.set_defaults(output_is_file=True)


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `map`: write a PNG to look at, or an EXR of linear Rec.709 radiance under unit irradiance."""
    if arguments.output.suffix.lower() not in (".png", ".exr"):
        raise GratingError(arguments.output, "neither PNG nor EXR", "name the file .png or .exr")
    bundled("PIL.Image" if arguments.output.suffix.lower() == ".png" else "OpenEXR")  # fail before the map is computed
    progress = Progress(arguments.progress)
    with naming(arguments.file):
        xyz, illuminant = brdf_map_of(arguments, progress)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    write_picture(arguments.output, xyz, illuminant)
    emit({"files": [str(arguments.output)]}, arguments.json, lambda: [str(arguments.output)])


def brdf_map_of(arguments: argparse.Namespace, progress: Progress) -> tuple[np.ndarray, str]:
    """The map (size, size, 3) in XYZ and its illuminant, from a bake's file or folder, or else from a height map."""
    theta_i, stam = np.radians(arguments.theta_i), arguments.form == "stam"
    file = existing_bake(arguments.file)
    if file is not None:
        if arguments.method != baked.ENTRY.name:
            remedy = ("give ", Setting.METHOD, f" {arguments.method} the height map")
            raise GratingError(file, "a bake no longer holds the surface", remedy)
        table, _ = atlas_file.read(file)
        return brdf_map.from_bake(table, arguments.size, theta_i, stam=stam), table.illuminant
    length_m = None if arguments.coherence_um is None else arguments.coherence_um * 1e-6
    relief = prepare(height_map_of(arguments))
    if arguments.method == baked.ENTRY.name:
        table = atlas.unpack(*atlas.pack(bake(relief, BakeRequest(coherence_length_m=length_m), progress=progress)))
        return brdf_map.from_bake(table, arguments.size, theta_i, stam=stam), table.illuminant
    if arguments.method != exact.Ensemble.name:
        return method_map(relief, length_m, arguments, progress=progress), "D65"
    sigma_b = plan(relief, BakeRequest(coherence_length_m=length_m)).sigma_b
    xyz = brdf_map.from_reference(
        relief, sigma_b, arguments.size, theta_i=theta_i, step_m=arguments.step_nm * 1e-9, stam=stam,
        progress=progress,
    )  # fmt: skip
    return xyz, "D65"


def method_map(
    relief: Relief, length_m: float | None, arguments: argparse.Namespace, *, progress: Progress
) -> np.ndarray:
    """The map (size, size, 3) in XYZ by one of METHODS, in Stam's form."""
    settings = Settings(
        coherence_length_m=length_m,
        terms=arguments.terms,
        step_m=arguments.step_nm * 1e-9,
        dtype=np.dtype(arguments.precision).type,
        centred=arguments.centred,
        period_m=period_of(arguments),
    )
    method = METHODS[arguments.method](relief, settings)
    return brdf_map.from_method(method, arguments.size, np.radians(arguments.theta_i), progress=progress)


def write_picture(path: Path, xyz: np.ndarray, illuminant: str) -> None:
    """Write XYZ (size, size, 3) as a PNG to look at, or as an EXR of linear Rec.709."""
    if path.suffix.lower() == ".png":
        write_whole(path, bundled("PIL.Image").fromarray(brdf_map.picture(xyz, illuminant)).save)
        return
    rgb = np.nan_to_num(brdf_map.linear_rgb(xyz, illuminant)).astype(np.float32)
    write_whole(path, lambda partial: atlas_file.write_exr(partial, rgb, {}))
