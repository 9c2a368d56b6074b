# SPDX-License-Identifier: GPL-3.0-or-later
"""Directional albedo at R = 1 of every sample, in Stam's form and in the energy-conserving form.

    ./dev bench albedo [SAMPLE ...]

This quadrature is independent of the quadrature that computes a bake's albedo bound: it uses neither a picture of the
spectrum nor cells. Each point is a bin of the spectrum, drawn in proportion to its power, moved within the coherence
kernel by a low-discrepancy sequence, and evaluated at its own w. The phasor's series is exact to 1e-6. The table gives
the largest albedo over wavelengths and azimuths, without a bound and with the bound stored in the bake's file.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from precompute.bake.ensemble import bake
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import WAVELENGTH_MIN_M
from precompute.reference.ensemble_reference import reference_grid
from precompute.spectra.series import SpectrumSeries, spectrum_series
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.catalogue import SAMPLES, make_sample
from precompute.table import atlas

from . import report

ANGLES_DEG = (0.0, 30.0, 60.0, 75.0, 85.0, 89.0, 89.9)
AZIMUTHS_DEG = (0.0, 37.0, 90.0)
WAVELENGTHS_M = tuple(np.linspace(385e-9, 775e-9, 9))

Bound = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Surface:
    """The exact spectrum of a relief and the standard deviation of its kernel."""

    series: SpectrumSeries
    sigma_b: float


def surface_of(relief: Relief, sigma_b: float) -> Surface:
    """The spectrum of a relief at every bin that a direction can reach, for a kernel of sigma_b."""
    grid = reference_grid(relief, sigma_b)
    return Surface(spectrum_series(relief, grid, 2 / WAVELENGTH_MIN_M, tolerance=1e-6), sigma_b)


def no_bound(directions: np.ndarray) -> np.ndarray:
    """The bound of Stam's form: 1 for all directions (..., 3)."""
    return np.ones(directions.shape[:-1])


def directional_albedo(surface: Surface, wi: np.ndarray, lam: float, bounds: list[Bound], points: int = 1 << 16):
    """Albedo (len(bounds),) at R = 1 for light from wi (3,): the integral of f cos(tr) / max(bound(wi), bound(wr))."""
    series, sigma = surface.series, surface.sigma_b
    first, jitter = (np.arange(points) + 0.5) / points, _normal(points) * sigma
    power = series.weights(1 / lam)[None] @ series.scattered_over_s2.reshape(len(series.amplitude), -1)
    power = np.maximum(power[0], 0)
    total = np.zeros(len(bounds))
    if power.sum() > 0:
        cumulative = np.cumsum(power)
        drawn = np.minimum(np.searchsorted(cumulative, first * cumulative[-1]), len(power) - 1)
        row, col = np.unravel_index(drawn, series.scattered_over_s2.shape[1:])
        half = lam * np.stack([series.grid.q_x[col], series.grid.q_y[row]], axis=-1) + jitter
        wr, w, real = _views(half, wi)
        exact = np.einsum("pn,np->p", series.weights(w / lam), series.scattered_over_s2[:, row, col]) / lam**2
        value = (1 + wr @ wi) ** 2 / (wi[2] * np.maximum(wr[:, 2], 1e-9)) * exact
        value = real * value * cumulative[-1] / power[drawn]
        total += [np.mean(value / np.maximum(bound(wi), bound(wr))) for bound in bounds]
    wr, w, real = _views(jitter, wi)
    value = real * series.zero_order(w / lam)
    return total + [np.mean(value / np.maximum(bound(wi), bound(wr))) for bound in bounds]


def _views(half: np.ndarray, wi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """View directions (n, 3) for tangential half vectors (n, 2), their w (n,), and a mask (n,) of propagating ones."""
    tangential = half - wi[:2]
    square = np.sum(tangential**2, axis=1)
    cosine = np.sqrt(np.maximum(1 - square, 0))
    return np.column_stack([tangential, cosine]), wi[2] + cosine, square < 1


def _normal(count: int) -> np.ndarray:
    """Normally distributed pairs (count, 2): the plastic number's sequence (Roberts 2018), Box-Muller transform."""
    plastic = 1.32471795724474602596
    index = np.arange(1, count + 1)
    radius, turn = (0.5 + index / plastic) % 1, (0.5 + index / plastic**2) % 1
    return np.sqrt(-2 * np.log(1 - radius))[:, None] * np.column_stack(
        [np.cos(2 * np.pi * turn), np.sin(2 * np.pi * turn)]
    )


def directions(theta_deg: float, azimuths_deg=AZIMUTHS_DEG) -> Iterator[np.ndarray]:
    """Unit directions (3,) at theta_deg degrees from the normal, at each azimuth."""
    for azimuth in np.radians(azimuths_deg):
        theta = np.radians(theta_deg)
        yield np.array([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)])


def greatest(surface: Surface, bounds: list[Bound], theta_deg: float, wavelengths=WAVELENGTHS_M) -> np.ndarray:
    """The largest albedo (len(bounds),) over azimuths and wavelengths."""
    return np.max(
        [directional_albedo(surface, wi, lam, bounds) for wi in directions(theta_deg) for lam in wavelengths], axis=0
    )


def main(argv: list[str] | None = None) -> None:
    """Print the table of the given samples."""
    parser = OneLineParser(description=__doc__.splitlines()[0])
    parser.add_argument("samples", nargs="*", default=list(SAMPLES), help="names of samples; default all")
    report.add_json(parser)
    arguments, facts = parser.parse_args(argv), {}
    for name in arguments.samples:
        relief = prepare(make_sample(name))
        baked = atlas.unpack(*atlas.pack(bake(relief)))
        surface = surface_of(relief, baked.sigma_b)
        rows = [greatest(surface, [no_bound, baked.albedo_bound_at], theta) for theta in ANGLES_DEG]
        facts[name] = dict(zip(("Stam", "conserving"), np.transpose(rows).tolist(), strict=True))
        report.say(f"{name:12}" + "".join(f"{theta:9g}" for theta in ANGLES_DEG), arguments.json)
        for label, column in facts[name].items():
            report.say(f"  {label:10}" + "".join(f"{value:9.4f}" for value in column), arguments.json)
    report.write({"angles_deg": ANGLES_DEG, "albedo": facts}, arguments.json)


if __name__ == "__main__":
    main()
