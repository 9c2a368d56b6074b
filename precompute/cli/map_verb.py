# SPDX-License-Identifier: GPL-3.0-or-later
"""`map`: a BRDF map over the hemisphere of view."""

import argparse
from pathlib import Path

import numpy as np

from ..bake.ensemble import bake, plan
from ..bake.request import BakeRequest
from ..base.failure import GratingError, Setting
from ..base.files import write_whole
from ..base.machine import bundled
from ..colour.illuminants import parts_of
from ..colour.observer import wavelengths
from ..maps import brdf_map
from ..maps.brdf_map import write_spectra, write_xyz
from ..methods import baked, exact
from ..methods.method import Method, Settings
from ..methods.method_registry import ENTRIES, MAP_METHODS, METHODS
from ..spectra.spectrum import shifted
from ..surface.relief import Relief, prepare
from ..table import atlas
from ..table.table import Table
from .arguments import (
    PERIOD_NM,
    STEP_NM,
    TERMS,
    add_input,
    add_patch,
    coherence_argument,
    count,
    existing_bake,
    height_map_of,
    lamp_argument,
    naming,
    number,
    path_argument,
    period_of,
)
from .printing import Progress, emit

# What an EXR can hold.
RGB, XYZ, SPECTRUM = "rgb", "xyz", "spectrum"


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
    parser.add_argument(
        "--phi-i",
        type=number(-360, 360),
        default=0.0,
        metavar="DEG",
        help="turn of the light about the normal, counterclockwise; default 0",
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
    add_patch(parser, "the window of a method of one patch")
    parser.add_argument(
        "--form",
        choices=("material", "stam"),
        default="material",
        help="form of the BRDF: that of the materials, or Stam's; the thesis's methods have Stam's",
    )
    parser.add_argument(
        "--lamp",
        type=lamp_argument,
        metavar="LIGHT",
        help="the lamp's spectrum, as --illuminant of `bake` names it; by default that of the bake, or D65. A mirror "
        "stays white. A bake needs the channels of --illuminant smooth or led, or this lamp in its --illuminant",
    )
    parser.add_argument(
        "--channels",
        choices=(RGB, XYZ, SPECTRUM),
        default=RGB,
        help="what an EXR holds: linear Rec.709, CIE XYZ, or a channel for each wavelength; default rgb",
    )
    parser.add_argument(
        "--wavelength-nm",
        type=number(380, 780),
        action="append",
        metavar="NM",
        help="a wavelength of the spectrum (repeatable); default: every --step-nm",
    )
    parser.set_defaults(output_is_file=True)


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `map`: write a PNG to look at, or an EXR of radiance under unit irradiance."""
    _check(arguments)
    bundled("PIL.Image" if arguments.output.suffix.lower() == ".png" else "OpenEXR")  # fail before the map is computed
    progress = Progress(arguments.progress)
    with naming(arguments.file):
        if arguments.channels == SPECTRUM:
            lambdas = spectrum_wavelengths(arguments)
            image = spectra_of(arguments, lambdas, progress)
        else:
            image, illuminant = brdf_map_of(arguments, progress)
    arguments.output.parent.mkdir(parents=True, exist_ok=True)
    if arguments.channels == SPECTRUM:
        write_whole(arguments.output, lambda partial: write_spectra(partial, image, lambdas))
    elif arguments.channels == XYZ:
        write_whole(arguments.output, lambda partial: write_xyz(partial, image))
    else:
        write_picture(arguments.output, image, illuminant)
    emit({"files": [str(arguments.output)]}, arguments.json, lambda: [str(arguments.output)])


def _check(arguments: argparse.Namespace) -> None:
    """Raise GratingError for arguments that contradict each other."""
    suffix = arguments.output.suffix.lower()
    if suffix not in (".png", ".exr"):
        raise GratingError(arguments.output, "neither PNG nor EXR", "name the file .png or .exr")
    if arguments.channels != RGB and suffix == ".png":
        fault = f"a PNG cannot hold --channels {arguments.channels}"
        raise GratingError(arguments.output, fault, "name the file .exr")
    if arguments.patch_um is not None and ENTRIES[arguments.method].coherence != "patch":
        of_a_patch = [name for name in MAP_METHODS if ENTRIES[name].coherence == "patch"]
        raise GratingError(
            "--patch-um", f"the method {arguments.method} has no window on one patch",
            ("leave it out, or give ", Setting.METHOD, f" one of {', '.join(of_a_patch)}"),
        )  # fmt: skip
    of_lamps = (baked.ENTRY.name, exact.Ensemble.name)
    if arguments.lamp is not None and (arguments.channels == SPECTRUM or arguments.method not in of_lamps):
        of = "a spectrum" if arguments.channels == SPECTRUM else f"the method {arguments.method}"
        raise GratingError(
            "--lamp", f"{of} has no lamp",
            ("leave it out, or give ", Setting.METHOD, f" {' or '.join(of_lamps)} and other --channels"),
        )  # fmt: skip
    if arguments.channels != SPECTRUM:
        if arguments.wavelength_nm:
            remedy = f"give --channels {SPECTRUM}, or leave it out"
            raise GratingError("--wavelength-nm", f"--channels {arguments.channels} has no wavelengths", remedy)
        return
    if existing_bake(arguments.file) is not None or arguments.method == baked.ENTRY.name:
        raise GratingError(
            arguments.file, "a bake holds colours, no spectra",
            ("give the height map and ", Setting.METHOD, f" {exact.Ensemble.name}, or another method"),
        )  # fmt: skip


def spectrum_wavelengths(arguments: argparse.Namespace) -> np.ndarray:
    """The wavelengths (k,) in metres of a map of spectra, in ascending order."""
    if not arguments.wavelength_nm:
        return wavelengths(arguments.step_nm * 1e-9)
    return np.unique(np.array(arguments.wavelength_nm)) * 1e-9


def light_of(arguments: argparse.Namespace) -> np.ndarray:
    """The unit vector (3,) to the light."""
    return brdf_map.light_from(np.radians(arguments.theta_i), np.radians(arguments.phi_i))


def brdf_map_of(arguments: argparse.Namespace, progress: Progress) -> tuple[np.ndarray, str]:
    """The map (size, size, 3) in XYZ and its illuminant, from a bake's file or folder, or else from a height map."""
    wi, stam = light_of(arguments), arguments.form == "stam"
    file = existing_bake(arguments.file)
    if file is not None:
        if arguments.method != baked.ENTRY.name:
            remedy = ("give ", Setting.METHOD, f" {arguments.method} the height map")
            raise GratingError(file, "a bake no longer holds the surface", remedy)
        table = _under(atlas.read(file)[0], arguments.lamp, file)
        return brdf_map.from_bake(table, arguments.size, wi, stam=stam), table.illuminant
    length_m, illuminant = _length_of(arguments), arguments.lamp or "D65"
    relief = prepare(height_map_of(arguments))
    if arguments.method == baked.ENTRY.name:
        request = BakeRequest(coherence_length_m=length_m, illuminant=illuminant)
        table = atlas.unpack(*atlas.pack(bake(relief, request, progress=progress)))
        return brdf_map.from_bake(table, arguments.size, wi, stam=stam), table.illuminant
    if arguments.method == exact.Ensemble.name:
        seen = brdf_map.seen_colour(arguments.step_nm * 1e-9, illuminant)
        return _by_reference(relief, seen, arguments, progress=progress), illuminant
    return brdf_map.from_method(method_of(relief, arguments), arguments.size, wi, progress=progress), "D65"


def _under(table: Table, lamp: str | None, file: Path) -> Table:
    """A bake's table under a lamp. Raises GratingError for a bake without channels for another lamp than its own."""
    if lamp is None or lamp == table.illuminant:
        return table
    if len(parts_of(table.illuminant)) == 1:
        fault = f"a bake for {table.illuminant:.40} alone has no colours under {lamp:.40}"
        raise GratingError(file, fault, "bake with --illuminant smooth, led, or this lamp")
    return table.under(lamp)


def spectra_of(arguments: argparse.Namespace, lambdas_m: np.ndarray, progress: Progress) -> np.ndarray:
    """The map (size, size, k) at wavelengths (k,) in metres, by the reference or by one of METHODS."""
    relief = prepare(height_map_of(arguments))
    if arguments.method == exact.Ensemble.name:
        return _by_reference(relief, brdf_map.seen_spectrum(lambdas_m), arguments, progress=progress)
    method = method_of(relief, arguments)
    return brdf_map.from_method(method, arguments.size, light_of(arguments), lambdas_m=lambdas_m, progress=progress)


def _by_reference(
    relief: Relief, seen: brdf_map.Seen, arguments: argparse.Namespace, *, progress: Progress
) -> np.ndarray:  # fmt: skip
    sigma_b = plan(relief, BakeRequest(coherence_length_m=_length_of(arguments))).sigma_b
    return brdf_map.from_reference(
        relief, sigma_b, arguments.size, wi=light_of(arguments), seen=seen, stam=arguments.form == "stam",
        progress=progress,
    )  # fmt: skip


def _length_of(arguments: argparse.Namespace) -> float | None:
    return None if arguments.coherence_um is None else arguments.coherence_um * 1e-6


def method_of(relief: Relief, arguments: argparse.Namespace) -> Method:
    """One of METHODS for a relief. Its maps have Stam's form."""
    settings = Settings(
        coherence_length_m=_length_of(arguments),
        terms=arguments.terms,
        step_m=arguments.step_nm * 1e-9,
        dtype=np.dtype(arguments.precision).type,
        centred=arguments.centred,
        period_m=period_of(arguments),
    )
    if arguments.patch_um is not None:
        relief = shifted(relief, settings.patch_sigma_m, arguments.patch_um)
    return METHODS[arguments.method](relief, settings)


def write_picture(path: Path, xyz: np.ndarray, illuminant: str) -> None:
    """Write XYZ (size, size, 3) as a PNG to look at, or as an EXR of linear Rec.709."""
    if path.suffix.lower() == ".png":
        write_whole(path, bundled("PIL.Image").fromarray(brdf_map.picture(xyz, illuminant)).save)
        return
    rgb = np.nan_to_num(brdf_map.linear_rgb(xyz, illuminant)).astype(np.float32)
    write_whole(path, lambda partial: atlas.write_exr(partial, rgb, {}))
