# SPDX-License-Identifier: GPL-3.0-or-later
"""FLSS: full lambda space sampling with Taylor images (thesis Algorithms 1 and 3).

    exp(-i 2 pi s h) = sum_n (-2 pi s)^n / n! (i h)^n

Heights count from the lowest point (the thesis), or from the middle of the relief, which halves z = 2 pi s max|h|.
The terms grow to e^z / sqrt(2 pi z) before they fall, and their sum has modulus 1: all digits above that are lost. So a
run fails in two ways: too few terms, which only costs accuracy, or too few digits, which no number of terms mends.
"""

import json
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..failure import GratingError
from ..relief import Relief
from .method import S_MAX, Settings
from .term_images import TermImages, WindowedImages, windowed

# A run whose phasor is uncertain by more than this is refused.
LOSS_MAX = 1e-2
HEADER_KEY = "natural_gratings_taylor"


def truncation_error(z: float, terms: int) -> float:
    """Bound of what `terms` terms leave out of exp(-i z), z >= 0: z^N / N! (Lagrange, all derivatives of modulus 1)."""
    return math.exp(terms * math.log(z) - math.lgamma(terms + 1)) if z > 0 else 0.0


def terms_needed(z: float, tolerance: float) -> int:
    """The fewest terms whose bound is at most `tolerance`; the bound falls for good past N = z."""
    terms = max(1, math.ceil(z))
    while truncation_error(z, terms) > tolerance:
        terms += 1
    return terms


def rounding_bound(z: float, dtype: type) -> float:
    """Bound of what cancellation costs, however many terms: half a last digit of every term, eps / 2 * e^z."""
    return float(np.finfo(dtype).eps) / 2 * math.exp(min(z, 700.0))


def expected_loss(z: float, dtype: type) -> float:
    """What cancellation costs in practice: half a last digit of the largest term, z^n / n! at n = z (Stirling)."""
    return rounding_bound(z, dtype) / math.sqrt(max(2 * math.pi * z, 1.0))


@dataclass(frozen=True)
class Taylor:
    """The expansion: terms of (i h / scale_m)^n, h from origin_m; the scale keeps powers within floating point."""

    terms: int
    origin_m: float
    scale_m: float

    def fields(self, height_m: np.ndarray) -> Iterator[np.ndarray]:
        """(i h / scale)^n for n = 0 .. terms - 1."""
        x = 1j * (height_m - self.origin_m) / self.scale_m
        power = np.ones_like(x)
        for _ in range(self.terms):
            yield power
            power = power * x

    def coefficients(self, s: np.ndarray) -> np.ndarray:
        """(-2 pi s scale)^n / n! (m, terms)."""
        z = (-2 * np.pi * self.scale_m) * np.asarray(s, float)[:, None]
        factors = z / np.maximum(np.arange(self.terms), 1)
        factors[:, 0] = 1
        return np.cumprod(factors, axis=1)


def expansion_for(relief: Relief, settings: Settings, s_max: float = S_MAX) -> Taylor:
    """The Taylor expansion of a relief up to s_max.

    Raises GratingError where cancellation leaves too few digits, whatever the number of terms."""
    low, high = float(relief.height_m.min()), float(relief.height_m.max())
    origin = (low + high) / 2 if settings.centred else low
    scale = max(high - origin, 1e-12)
    z = 2 * np.pi * s_max * scale
    loss = expected_loss(z, settings.dtype)
    if loss > LOSS_MAX:
        name = np.dtype(settings.dtype).name
        raise GratingError(
            f"flss: the Taylor series of {(high - low) * 1e9:.0f} nm of relief cannot converge in {name}: at s = "
            f"{s_max * 1e-6:.2f} / um its largest term is e^{z:.1f} / sqrt(2 pi {z:.1f}), which leaves an error of "
            f"{loss:.2g} (bound {rounding_bound(z, settings.dtype):.2g}); take --method chebyshev"
        )
    return Taylor(settings.terms or terms_needed(z, settings.tolerance), origin, scale)


def build(relief: Relief, settings: Settings) -> WindowedImages:
    """FLSS of a relief. Raises GratingError for a relief that is too deep for the series."""
    return windowed("flss", relief, expansion_for(relief, settings), settings)


def write_taylor_images(path: Path, method: WindowedImages) -> None:
    """Thesis Algorithm 1's result as one OpenEXR file of float32 channels re.00, im.00, re.01, ...; rows along +v.

    The header's JSON holds what a reader needs, and the extrema of each term (re min, re max, im min, im max), with
    which the thesis scaled its images to 0..1. A temporary name first: a broken run leaves no half file behind."""
    import OpenEXR

    images = method.images
    channels = {}
    for n in range(images.terms.shape[-1]):
        for part, values in (("re", images.terms[..., n].real), ("im", images.terms[..., n].imag)):
            channels[f"{part}.{n:02d}"] = np.ascontiguousarray(values, np.float32)
    extrema = [
        [float(f) for part in (term.real, term.imag) for f in (part.min(), part.max())]
        for term in np.moveaxis(images.terms, -1, 0)
    ]
    record = {
        "terms": method.expansion.terms,
        "origin_m": method.expansion.origin_m,
        "scale_m": method.expansion.scale_m,
        "size_m": images.size_m,
        "sigma_f": method.sigma_f,
        "density_scale": method.scale,
        "extrema": extrema,
    }
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        HEADER_KEY: json.dumps(record, sort_keys=True),
    }
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.partial.exr")
    try:
        with OpenEXR.File(header, channels) as file:
            file.write(str(temporary))
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def read_taylor_images(path: Path, settings: Settings) -> WindowedImages:
    """The method in a file of write_taylor_images. Raises GratingError if it is not one.

    The window is the file's; `settings` give the wavelengths and the texels."""
    import OpenEXR

    if not path.is_file():
        raise GratingError(f"{path}: there is no such file; write the Taylor images first")
    try:
        file = OpenEXR.File(str(path), separate_channels=True)
        record = json.loads(file.header()[HEADER_KEY])
        channels = file.channels()
        terms = np.stack(
            [channels[f"re.{n:02d}"].pixels + 1j * channels[f"im.{n:02d}"].pixels for n in range(record["terms"])],
            axis=-1,
        ).astype(np.complex64)
        expansion = Taylor(record["terms"], record["origin_m"], record["scale_m"])
        images = TermImages(terms, tuple(record["size_m"]))
        return WindowedImages("flss", images, expansion, record["sigma_f"], record["density_scale"], settings)
    except Exception as error:  # OpenEXR's own type differs by version
        raise GratingError(f"{path}: not a file of Taylor images; write them again") from error
