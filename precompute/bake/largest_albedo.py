# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the largest share of its light that a surface would send back in the ratio form.

The ratio form (optics/brdf.py) can send back more light than arrives, at grazing light on steep reliefs. So a bake that
holds its matter's reflectance is divided by the largest directional albedo, if that is above 1. The albedo of light
from wi, with the symbols of table/sample_set.py, is

    a(wi) = zero order + integral of R 4 cos(ti) cos(tr) Q / (F w^2) PSD(q; w / lambda) d^2q

The integral is the mean over a small sample set, in which each texel has one wavelength. The albedo is of luminance
under the bake's illuminant, and does not depend on the part of (u, v, w) that the table holds.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from ..colour.channels import channel_weights
from ..colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, seen_wavelengths
from ..optics.brdf import half_angle_cosine, scattering_factor
from ..reflectance.matter import Matter
from ..spectra.series import SpectrumSeries
from ..table.sample_set import COEFFICIENTS, piece_and_powers
from .sample_draws import make_sample_set

# The directions of the light: angles from the normal, and azimuths over half a turn. A relief's spectrum is the same at
# q and -q, so the other half has the same albedos. Twice as many of each change the largest albedo of samples and of
# sinusoidal gratings by less than 1 % (tests/precompute/bake/test_largest_albedo.py).
_ANGLES_DEG = (0, 15, 30, 45, 55, 65, 70, 75, 80, 85, 88)
_AZIMUTHS = 12
# Texels a side of the sample set. Four times as many texels change the largest albedo by less than 1 %.
_SIZE = 64
# Number of cosines from 0 to 1 for which the reflectance is computed.
_COSINES = 513
# The step of a sequence that fills the range from 0 to 1 evenly: the golden ratio.
_GOLDEN = (5**0.5 - 1) / 2


def largest_albedo(
    ensemble: Sequence[SpectrumSeries], matter: Matter, illuminant: str, *, size: int = _SIZE, finer: int = 1
) -> float:
    """The largest directional albedo in luminance of a matter that the table holds; at least 1.

    `size` is the sample set's, a power of two. There are `finer` times as many azimuths, and angles."""
    lambdas = seen_wavelengths(np.linspace(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M, 401), illuminant)
    luminance = channel_weights(lambdas, illuminant)[:, 1]
    luminance = luminance / luminance.sum()
    curves = matter.reflectance(lambdas, np.linspace(0, 1, _COSINES))
    drawn = make_sample_set(ensemble, 0.0, size)
    q, pieces = drawn.q.reshape(-1, 2), drawn.pieces.reshape(len(drawn.pieces), -1, COEFFICIENTS)
    # Each texel's wavelength, drawn in proportion to the luminance.
    share = np.arange(len(q)) * _GOLDEN % 1
    own = np.minimum(np.searchsorted(np.cumsum(luminance), share), len(lambdas) - 1)
    half = q * lambdas[own, None]

    def scattered(wi: np.ndarray) -> float:
        across = half - wi[:2]
        cosine2 = 1 - (across**2).sum(axis=1)
        real = np.flatnonzero(cosine2 > 0)
        wr = np.column_stack([across[real], np.sqrt(cosine2[real])])
        lam, w = lambdas[own[real]], wi[2] + wr[:, 2]
        piece, powers = piece_and_powers(w / lam, len(pieces), drawn.s_max)
        weights = (pieces[piece, real] * powers).sum(axis=1) / lam**2
        ways = np.broadcast_to(wi, wr.shape)
        reflectance = curves[own[real], np.rint(half_angle_cosine(ways, wr) * (_COSINES - 1)).astype(int)]
        return float(
            (weights * reflectance * scattering_factor(ways, wr, ratio_ior=matter.ratio_ior)).sum() / (wi[2] * len(q))
        )

    found = 1.0
    for cosine, ways in _lights(finer):
        zero_order = np.mean([series.zero_order(2 * cosine / lambdas) for series in ensemble], axis=0)
        mirrored = float(luminance @ (zero_order * matter.reflectance(lambdas, np.array([cosine]))[:, 0]))
        found = max(found, mirrored + max(map(scattered, ways)))
    return found


def _lights(finer: int) -> Iterator[tuple[float, np.ndarray]]:
    """Directions of light: the cosine of each ring, and its unit vectors (n, 3)."""
    steps = np.arange(finer * (len(_ANGLES_DEG) - 1) + 1) / finer
    azimuth = np.pi * np.arange(finer * _AZIMUTHS) / (finer * _AZIMUTHS)
    for theta in np.radians(np.interp(steps, np.arange(len(_ANGLES_DEG)), _ANGLES_DEG)):
        along = np.sin(theta) * np.stack([np.cos(azimuth), np.sin(azimuth)])
        yield np.cos(theta), np.stack([*along, np.full(len(azimuth), np.cos(theta))], axis=-1)
