# SPDX-License-Identifier: GPL-3.0-or-later
"""Compares the bake's colours over the first order with the reference's.

A bake holds colours and no wavelengths, so the period at each wavelength cannot be evaluated."""

import time
from dataclasses import asdict, dataclass
from functools import cache

import numpy as np

from precompute.base.failure import GratingError
from precompute.colour.observer import observer, spectral_weights, wavelengths, white_xyz
from precompute.methods import baked
from precompute.methods.exact import Ensemble
from precompute.methods.method import Settings
from precompute.surface.relief import Relief

from .evaluation import peak
from .response import FirstOrder, response

# Views are compared where Y is at least this share of its maximum.
_BRIGHT = 0.1


@dataclass(frozen=True)
class ColourComparison:
    """The bake's colours over the first order, compared with the ensemble reference at the bake's kernel.

    peak_angle_deg, reference_peak_angle_deg  viewing angle in degrees of the greatest Y; None if the bake is dark
    dominant_wavelength_rms_nm                rms difference of the dominant wavelength, over the views whose Y is at
                                              least a tenth of the greatest; None if no view has a dominant wavelength
    relative_dy                               sum of |dY| over the sum of Y
    seconds                                   duration of the bake
    """

    peak_angle_deg: float | None
    reference_peak_angle_deg: float
    dominant_wavelength_rms_nm: float | None
    relative_dy: float
    seconds: float

    def as_dict(self) -> dict[str, float | None]:
        """A record for JSON: the keys of Evaluation with null values, then this comparison's values."""
        of_wavelengths = dict.fromkeys(("period_mean_nm", "period_variance_nm", "peak_angle_rms_deg"))
        return {**of_wavelengths, **asdict(self)}

    def summary(self) -> str:
        """The row of the printed table, without the method's name."""
        off = self.dominant_wavelength_rms_nm
        peak_at = "dark" if self.peak_angle_deg is None else f"brightest at {self.peak_angle_deg:.3f} degrees"
        hue = "no dominant wavelength" if off is None else f"dominant wavelength rms {off:.2f} nm"
        return (
            f"{peak_at}, the reference at {self.reference_peak_angle_deg:.3f}; "
            f"{hue}; |dY| {self.relative_dy:.2%}; {self.seconds:.1f} s"
        )


def compare_bake(relief: Relief, settings: Settings, first_order: FirstOrder) -> ColourComparison:
    """Bake a relief and compare the colours of its first order with the reference's, summed in steps of 1 nm.

    Raises GratingError if the period has no first order above the horizon, or if the reference is dark there."""
    started = time.perf_counter()
    made = baked.build(relief, settings)
    seconds = time.perf_counter() - started
    lambdas = wavelengths(1e-9)
    plane = first_order.plane
    density = response(Ensemble(relief, made.table.sigma_b, settings), plane, lambdas)
    truth = density.T @ spectral_weights(lambdas, settings.illuminant)
    got = made.xyz(plane.u, np.zeros(len(plane.u)), plane.w)
    angles = np.degrees(plane.theta_v)
    brightest, reference_brightest = peak(angles, got[:, 1]), peak(angles, truth[:, 1])
    if np.isnan(reference_brightest):
        raise GratingError(
            baked.ENTRY.name, f"dark around the first order of {first_order.period_m * 1e9:.0f} nm", "give --period-nm"
        )
    bright = truth[:, 1] >= _BRIGHT * truth[:, 1].max()
    off = dominant_wavelength(got[bright], settings.illuminant) - dominant_wavelength(
        truth[bright], settings.illuminant
    )
    return ColourComparison(
        peak_angle_deg=None if np.isnan(brightest) else brightest,
        reference_peak_angle_deg=reference_brightest,
        dominant_wavelength_rms_nm=float(np.sqrt(np.nanmean(off**2)) * 1e9) if np.isfinite(off).any() else None,
        relative_dy=float(np.abs(got[:, 1] - truth[:, 1]).sum() / truth[:, 1].sum()),
        seconds=seconds,
    )


@cache
def _locus() -> tuple[np.ndarray, np.ndarray]:
    """The spectral locus: wavelengths in metres and chromaticities (n, 2). Over its range the direction from any white
    to the locus is monotonic."""
    lambdas = np.arange(420, 681) * 1e-9
    xyz = observer(lambdas, "E")
    return lambdas, (xyz / xyz.sum(axis=1, keepdims=True))[:, :2]


def dominant_wavelength(xyz: np.ndarray, illuminant: str = "D65") -> np.ndarray:
    """Dominant wavelength (n,) in metres of XYZ (n, 3): where the ray from the white point through the colour meets the
    spectral locus.

    NaN for purples, whose ray misses the locus, and outside 420 to 680 nm, where the locus hardly moves."""
    lambdas, locus = _locus()
    white = white_xyz(illuminant)
    white = (white / white.sum())[:2]
    hue = np.unwrap(np.arctan2(*(locus - white).T[::-1]))[::-1]
    total = np.sum(xyz, axis=-1, keepdims=True)
    dx, dy = (xyz[..., :2] / np.where(total > 0, total, np.nan) - white).T
    mine = hue[0] + (np.arctan2(dy, dx) - hue[0]) % (2 * np.pi)
    return np.interp(mine, hue, lambdas[::-1], left=np.nan, right=np.nan)
