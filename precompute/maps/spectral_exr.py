# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenEXR files of XYZ, or of spectra with a channel for each wavelength.

Channels of spectra are named as in A. Fichet, R. Pacanowski and A. Wilkie, "An OpenEXR Layout for Spectral Images",
JCGT 10(3), 2021: "T.550nm" is a reflectance at 550 nm, "T.550,5nm" one at 550.5 nm."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.packages import bundled


def write_xyz(path: Path, xyz: np.ndarray) -> None:
    """Write XYZ (rows, cols, 3), row 0 at the bottom. Raises as write_spectra does."""
    _write(path, {name: xyz[..., k] for k, name in enumerate("XYZ")}, {})


def write_spectra(path: Path, image: np.ndarray, lambdas_m: np.ndarray) -> None:
    """Write spectra (rows, cols, k), row 0 at the bottom, at wavelengths (k,) in metres.

    Raises OSError if they cannot be written, GratingError if OpenEXR cannot be loaded."""
    channels = {channel_name(lam): image[..., k] for k, lam in enumerate(lambdas_m)}
    _write(path, channels, {"spectralLayoutVersion": "1.0"})


def channel_name(lambda_m: float) -> str:
    """The name of a wavelength's channel, to a hundredth of a nanometre."""
    nanometres = f"{round(lambda_m * 1e9, 2):g}".replace(".", ",")
    return f"T.{nanometres}nm"


def _write(path: Path, channels: Mapping[str, np.ndarray], attributes: Mapping[str, str]) -> None:
    """Write named channels (rows, cols), with 0 where there is no number."""
    OpenEXR = bundled("OpenEXR")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    upright = {name: np.ascontiguousarray(np.nan_to_num(each)[::-1], np.float32) for name, each in channels.items()}
    # Given a path, OpenEXR fails outside UTF-8 and hides the system's error messages.
    with OpenEXR.File(header, upright) as picture, path.open("wb") as file:
        picture.write(file)
