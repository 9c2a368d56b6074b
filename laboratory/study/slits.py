# SPDX-License-Identifier: GPL-3.0-or-later
"""Far field of N slits in closed form (thesis 5.5 and 5.6; Born and Wolf 8.6.1).

    I(theta) = sinc^2(b sin(theta) / lambda) [sin(N pi d sin(theta) / lambda) / (N sin(pi d sin(theta) / lambda))]^2

for slits of width b and pitch d, scaled to 1 in the middle. The first factor is the pattern of one slit. The second has
its order m at d sin(theta) = m lambda and N - 2 side maxima between two orders. An order is as narrow as lambda / (N
d)."""

from pathlib import Path

import numpy as np

from precompute.colour.observer import spectral_weights, wavelengths
from precompute.colour.spaces import rgb_from_xyz, srgb_encode
from precompute.methods.pq import copies_sum

from . import plots

WIDTH_M = 30e-6
PITCH_M = 150e-6
SCREEN_M = 0.5
WAVELENGTH_M = 500e-9


def screen_sine(position_m: np.ndarray, distance_m: float = SCREEN_M) -> np.ndarray:
    """sin(theta) (n,) for positions (n,) on a screen, in metres from its middle."""
    return position_m / np.hypot(position_m, distance_m)


def envelope(sine: np.ndarray, wavelength_m: float, width_m: float = WIDTH_M) -> np.ndarray:
    """Intensity (n,) of one slit, 1 in the middle."""
    return np.sinc(width_m * np.asarray(sine) / wavelength_m) ** 2


def intensity(
    sine: np.ndarray, slits: int, wavelength_m: float, *, width_m: float = WIDTH_M, pitch_m: float = PITCH_M
) -> np.ndarray:
    """Intensity (n,) of N slits, 1 in the middle for every N."""
    phase = 2 * np.pi * pitch_m * np.asarray(sine) / wavelength_m
    return envelope(sine, wavelength_m, width_m) * np.abs(copies_sum(phase, slits) / slits) ** 2


def white_light(sine: np.ndarray, slits: int, step_m: float = 1e-9) -> np.ndarray:
    """XYZ (n, 3) under D65, scaled to Y = 1 in the middle of the screen."""
    lambdas = wavelengths(step_m)
    spectra = np.stack([intensity(sine, slits, lam) for lam in lambdas], axis=-1)
    return spectra @ spectral_weights(lambdas)


def plot(path: Path, counts: tuple[int, ...] = (1, 2, 5, 10), reach_m: float = 10e-3) -> None:
    """Write a plot with a row for each number of slits: the intensity at 500 nm, and below it the colours under D65.

    The plot shows the screen from -reach_m to reach_m. Raises GratingError if matplotlib is not installed."""
    pyplot = plots.pyplot()
    x = np.linspace(-reach_m, reach_m, 2001)
    sine = screen_sine(x)
    figure, panels = pyplot.subplots(
        2 * len(counts), 1, figsize=(8, 2 * len(counts)), sharex=True, height_ratios=[3, 1] * len(counts)
    )
    for k, slits in enumerate(counts):
        curve, strip = panels[2 * k], panels[2 * k + 1]
        curve.plot(x * 1e3, envelope(sine, WAVELENGTH_M), "0.6", linewidth=1)
        curve.plot(x * 1e3, intensity(sine, slits, WAVELENGTH_M), linewidth=1)
        curve.set_ylim(0, 1.05)
        curve.set_ylabel(f"N = {slits}")
        rgb = srgb_encode(white_light(sine, slits) @ rgb_from_xyz().T)
        strip.imshow(rgb[None], aspect="auto", extent=(x[0] * 1e3, x[-1] * 1e3, 0, 1))
        strip.set_yticks([])
    order = WAVELENGTH_M / PITCH_M
    for m in range(-6, 7):
        at = SCREEN_M * np.tan(np.arcsin(m * order)) * 1e3
        if abs(at) <= reach_m * 1e3:
            panels[0].annotate(str(m), (at, 1.08), ha="center", va="bottom", fontsize=8, annotation_clip=False)
    panels[-1].set_xlabel("place on the screen, mm")
    figure.tight_layout(h_pad=0.1)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
