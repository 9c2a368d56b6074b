# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake's colours over the first order beside the reference's: a bake has colours and no wavelengths."""

import time
from dataclasses import asdict, dataclass
from functools import cache

import numpy as np

from ..colour.observer import observer, spectral_weights, wavelengths, white_xyz
from ..methods.baked import Baked
from ..methods.exact import Ensemble
from ..methods.method import Settings
from ..methods.registry import METHODS
from ..surface.relief import Relief
from .evaluation import peak
from .response import first_order_plane, response

# Colours of the first order are compared where Y is at least this share of its greatest.
_BRIGHT = 0.1


# The bake has colours and no wavelengths.


@dataclass(frozen=True)
class ColourComparison:
    """The bake's colours over the first order beside those of the ensemble's reference at the bake's own kernel.

    Angles of greatest Y in degrees; rms difference of the dominant wavelength in nm, over the views whose Y is at least
    a tenth of the greatest and which have one; the share of Y that differs."""

    peak_angle_deg: float
    reference_peak_angle_deg: float
    dominant_wavelength_rms_nm: float
    relative_dy: float
    seconds: float

    def as_dict(self) -> dict[str, float | None]:
        """As Evaluation's, whose figures a bake has none of, and its own."""
        figures = dict.fromkeys(("period_mean_nm", "period_variance_nm", "peak_angle_rms_deg"))
        return {**figures, **asdict(self)}


def compare_bake(relief: Relief, settings: Settings, theta_i: float, around_m: float) -> ColourComparison:
    """Bake a relief and compare the colours of its first order; the reference sums 1 nm steps."""
    started = time.perf_counter()
    baked = METHODS["bake"](relief, settings)
    if not isinstance(baked, Baked):
        raise TypeError("METHODS['bake'] builds a Baked")
    seconds = time.perf_counter() - started
    lambdas = wavelengths(1e-9)
    plane = first_order_plane(theta_i, wavelengths(5e-9), around_m)
    density = response(Ensemble(relief, baked.table.sigma_b, settings), plane, lambdas)
    truth = density.T @ spectral_weights(lambdas, settings.illuminant)
    got = baked.xyz(plane.u, np.zeros(len(plane.u)), plane.w)
    bright = truth[:, 1] >= _BRIGHT * truth[:, 1].max()
    off = dominant_wavelength(got[bright], settings.illuminant) - dominant_wavelength(
        truth[bright], settings.illuminant
    )
    angles = np.degrees(plane.theta_v)
    return ColourComparison(
        peak(angles, got[:, 1]),
        peak(angles, truth[:, 1]),
        float(np.sqrt(np.nanmean(off**2)) * 1e9) if np.any(np.isfinite(off)) else float("nan"),
        float(np.abs(got[:, 1] - truth[:, 1]).sum() / truth[:, 1].sum()),
        seconds,
    )


@cache
def _locus() -> tuple[np.ndarray, np.ndarray]:
    """Wavelengths in metres and chromaticities (n, 2) of the spectrum, where they turn steadily about any white."""
    lambdas = np.arange(420, 681) * 1e-9
    xyz = observer(lambdas, "E")
    return lambdas, (xyz / xyz.sum(axis=1, keepdims=True))[:, :2]


def dominant_wavelength(xyz: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Dominant wavelength (n,) in metres of XYZ (n, 3): where the ray from the white meets the spectrum's locus.

    NaN for purples, which have none, and past 420 and 680 nm, where the locus hardly moves."""
    lambdas, locus = _locus()
    white = white_xyz(illuminant)
    white = (white / white.sum())[:2]
    hue = np.unwrap(np.arctan2(*(locus - white).T[::-1]))[::-1]
    total = np.sum(xyz, axis=-1, keepdims=True)
    dx, dy = (xyz[..., :2] / np.where(total > 0, total, np.nan) - white).T
    mine = hue[0] + (np.arctan2(dy, dx) - hue[0]) % (2 * np.pi)
    return np.interp(mine, hue, lambdas[::-1], left=np.nan, right=np.nan)
