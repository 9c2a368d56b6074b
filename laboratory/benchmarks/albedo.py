# SPDX-License-Identifier: GPL-3.0-or-later
"""Largest directional albedo of every sample, as a dielectric and as a metal.

    ./dev bench albedo [SAMPLE ...] [--directions 2000] [--json FILE|-]

The albedo is that of 2,000 directions, each at one wavelength. A dielectric has the small slope form at a few indices
of refraction. A metal has a reflectance of 1 in Stam's form, without a bound and with the bound of its bake.

This quadrature is independent of the quadrature that computes a bake's albedo bound: it uses neither a picture of the
spectrum nor cells. Each point is a bin of the spectrum, drawn in proportion to its power, moved within the coherence
kernel by a low-discrepancy sequence, and evaluated at its own w. The phasor's series is exact to 1e-6. Near the horizon
8,192 points have an error of up to 0.4 in a metal's albedo, so a direction that seems to reflect more than arrives is
measured again with 262,144 points.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from precompute.table.albedo_bound import albedo_bound

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.cli.option_types import count
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M
from precompute.optics.brdf import half_angle_cosine, scattering_factor
from precompute.optics.fresnel import fresnel_reflectance
from precompute.reference.ensemble_reference import reference_grid
from precompute.reflectance.matter import MIRRORING
from precompute.spectra.series import SpectrumSeries, spectrum_series
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.catalogue import SAMPLES, make_sample
from precompute.table import atlas

from . import report

POINTS, MANY_POINTS = 1 << 13, 1 << 18
IORS = (1.1, 1.56, 3.0)
AZIMUTHS_DEG = (0.0, 37.0, 90.0)

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


def directional_albedo(
    surface: Surface, wi: np.ndarray, lam: float, bounds: Sequence[Bound], points: int = 1 << 16, *,
    iors: Sequence[float] = (),
) -> np.ndarray:  # fmt: skip
    """Albedos (len(bounds) + len(iors),) for light from wi (3,).

    For each bound it is that of Stam's form at R = 1, the integral of f cos(tr) / max(bound(wi), bound(wr)). For each
    index of refraction it is that of a dielectric."""
    series, sigma = surface.series, surface.sigma_b
    first, jitter = (np.arange(points) + 0.5) / points, _normal(points) * sigma
    power = series.weights(1 / lam)[None] @ series.scattered_over_s2.reshape(len(series.amplitude), -1)
    power = np.maximum(power[0], 0)

    def means(density: np.ndarray, wr: np.ndarray, *, scattered: bool) -> np.ndarray:
        """The mean of a density (n,), of light that is scattered to views (n, 3) or mirrored, in each form."""
        stam = (1 + wr @ wi) ** 2 / (wi[2] * np.maximum(wr[:, 2], 1e-9)) if scattered else 1.0
        found = [np.mean(stam * density / np.maximum(bound(wi), bound(wr))) for bound in bounds]
        ways = np.broadcast_to(wi, wr.shape)
        for ior in iors:
            if scattered:
                factor = scattering_factor(ways, wr, ior) / wi[2]
            else:
                factor = fresnel_reflectance(half_angle_cosine(ways, wr), ior)
            found.append(np.mean(factor * density))
        return np.array(found)

    mirrored = wi * (-1, -1, 1)
    total = means(series.zero_order(2 * wi[2:] / lam), mirrored[None], scattered=False)
    if power.sum() > 0:
        cumulative = np.cumsum(power)
        drawn = np.minimum(np.searchsorted(cumulative, first * cumulative[-1]), len(power) - 1)
        row, col = np.unravel_index(drawn, series.scattered_over_s2.shape[1:])
        half = lam * np.stack([series.grid.q_x[col], series.grid.q_y[row]], axis=-1) + jitter
        wr, w, real = _views(half, wi)
        exact = np.einsum("pn,np->p", series.weights(w / lam), series.scattered_over_s2[:, row, col]) / lam**2
        total += means(real * exact * cumulative[-1] / power[drawn], wr, scattered=True)
    return total


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


def all_directions(count: int) -> np.ndarray:
    """Unit vectors (count, 3) with equally spaced cosines, at azimuths by the golden ratio."""
    cosine = (np.arange(count) + 0.5) / count
    azimuth = 2 * np.pi * (np.arange(count) * (np.sqrt(5) - 1) / 2 % 1)
    sine = np.sqrt(1 - cosine**2)
    return np.column_stack([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])


def main(argv: list[str] | None = None) -> None:
    """Print the largest albedos of the given samples."""
    parser = OneLineParser(description=__doc__.splitlines()[0])
    parser.add_argument("samples", nargs="*", default=list(SAMPLES), help="names of samples; default all")
    parser.add_argument("--directions", type=count(1, 1_000_000), default=2000)
    report.add_json(parser)
    arguments, facts = parser.parse_args(argv), {}
    # Wavelengths by the square root of 2, so that neighbouring directions have different ones.
    share = np.arange(arguments.directions) * np.sqrt(2) % 1
    lambdas = WAVELENGTH_MIN_M + (WAVELENGTH_MAX_M - WAVELENGTH_MIN_M) * share
    for name in arguments.samples:
        relief = prepare(make_sample(name))
        baked = atlas.unpack(*atlas.pack(bake(relief, BakeRequest(matter=MIRRORING))))
        assert baked.excess_albedo is not None
        bounds = [no_bound, partial(albedo_bound, baked.excess_albedo)]
        surface = surface_of(relief, baked.sigma_b)
        found = []
        for wi, lam in zip(all_directions(arguments.directions), lambdas, strict=True):
            found.append(directional_albedo(surface, wi, lam, bounds, POINTS, iors=IORS))
            if found[-1][1:].max() > 1:
                found[-1] = directional_albedo(surface, wi, lam, bounds, MANY_POINTS, iors=IORS)
        labels = ("Stam's form", "metal", *(f"IOR {ior:g}" for ior in IORS))
        facts[name] = dict(zip(labels, np.max(found, axis=0).tolist(), strict=True))
        told = ", ".join(f"{label} {value:.4f}" for label, value in facts[name].items())
        report.say(f"{name:12}{told}", arguments.json)
    report.write({"directions": arguments.directions, "albedo": facts}, arguments.json)


if __name__ == "__main__":
    main()
