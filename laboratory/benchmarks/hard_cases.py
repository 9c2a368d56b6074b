# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases: each bake either agrees with the reference or is refused with a reason.

    ./dev bench hard_cases [--json FILE|-]

Each surface is baked as the command `bake` does it. The table that the bake's file would hold is compared with the
reference (exact transforms in float64, precompute/reference) on a few hundred pairs that the self-check does not use.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from precompute.bake.ensemble import carry_out, plan
from precompute.bake.make import make
from precompute.bake.needs import EVERYTHING, Needs
from precompute.bake.request import BakeRequest
from precompute.bake.shown_directions import joined, needs_of, under_lamp
from precompute.base.failure import GratingError
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import WAVELENGTH_MIN_M, spectral_weights, wavelengths
from precompute.maths import chebyshev
from precompute.measure import truths
from precompute.measure.errors import Errors, Pairs, Truth, measure
from precompute.optics.region import Region
from precompute.reference.reference import reference_xyz
from precompute.reflectance.matter import MIRRORING
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.ruled_gratings import sinusoidal
from precompute.table.table import Table

from . import report
from .hemisphere import directional_albedo_xyz

PIXEL_M = 80e-9
W_COUNT, PAIRS = 3, 150
# The coarsest wavelength step that resolves the colour matching functions.
STEP_MAX_M = 3e-9
GRAZING = np.radians(89.9)
# The smallest needs a request can state: a fifth of a texel at this coherence.
ONE_TEXEL = Needs(Region((0.2, 0.22), (0.1, 0.12)), (1.5, 1.52))
# Gives a kernel of 0.12, for which even the small surfaces here hold 30 coherence areas.
COHERENCE_M = 2e-6
# Gives a kernel of 0.0062.
LONG_M = 40e-6
Baker = Callable[[Relief, float | None, Needs], Table]
Truths = Callable[[Relief, float], list[Truth]]


def wavelength_step(sigma_b: float) -> float:
    """The wavelength step of the reference, in metres.

    Between neighbouring wavelengths an order at |u| = 2 moves by at most two sigma_b: Gaussians at that distance add up
    to a constant within 1.4 %. An order at |u| = 1 moves by at most one sigma_b, where the sum is constant within 5e-9.
    """
    return min(STEP_MAX_M, sigma_b * WAVELENGTH_MIN_M)


def anywhere(relief: Relief, sigma_b: float) -> list[Truth]:
    """Direction pairs drawn as for every error measurement (precompute/measure/truths.py)."""
    return truths.truths(relief, sigma_b, W_COUNT, pairs_each=PAIRS, step_m=wavelength_step(sigma_b), seed=7)


def grazing(relief: Relief, sigma_b: float) -> list[Truth]:
    """Light at 89.9 degrees from all azimuths, seen at 89.9, 73 and 26 degrees, up to half a radian beside the mirror
    direction. Farther away the skin is black."""
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    light, aside = polar(GRAZING, turn), 0.5 * np.sin(7 * turn)
    views = (polar(view, turn + np.pi + aside) for view in (GRAZING, np.radians(73), np.radians(26)))
    return [truth(relief, sigma_b, light, view) for view in views]


def mirrored(relief: Relief, sigma_b: float) -> list[Truth]:
    """Views in the mirror direction of the light, where u = v = 0."""
    turn = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    angles = np.radians([0, 30, 60, 80, 89])
    return [truth(relief, sigma_b, polar(angle, turn), polar(angle, turn + np.pi)) for angle in angles]


def beyond(relief: Relief, sigma_b: float) -> list[Truth]:
    """Light at 80 degrees on the side of +T, seen at 35 to 65 degrees on the same side: u from 1.5 to 1.9."""
    light = polar(np.radians(80), np.linspace(-0.03, 0.03, 60))
    return [truth(relief, sigma_b, light, polar(np.radians(view), np.full(60, 0.02))) for view in (35, 50, 65)]


def polar(theta: float, azimuth: np.ndarray) -> np.ndarray:
    """Unit directions (n, 3) at theta radians from the normal and azimuths (n,) from T."""
    sine = np.sin(theta)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), np.full(len(azimuth), np.cos(theta))], axis=-1)


def truth(relief: Relief, sigma_b: float, wi: np.ndarray, wr: np.ndarray) -> Truth:
    """The reference for direction pairs wi, wr (n, 3) that share one w."""
    pairs, w = Pairs(wi, wr, np.ones(len(wi), bool)), float(wi[0, 2] + wr[0, 2])
    return Truth(
        w, pairs, *reference_xyz(relief, (pairs.u, pairs.v), w=w, sigma_b=sigma_b, step_m=wavelength_step(sigma_b))
    )


def horizon(relief: Relief, sigma_b: float) -> list[Truth]:
    """Light at 89.9 degrees around +T, seen from the other side at 80, 60 and 45 degrees."""
    turn = np.linspace(-0.1, 0.1, 60)
    return [
        truth(relief, sigma_b, polar(GRAZING, turn), polar(np.radians(view), turn + np.pi)) for view in (80, 60, 45)
    ]


def horizon_needs() -> Needs:
    """The needs of the pairs of `horizon`."""
    turn, one = np.linspace(-0.1, 0.1, 60), np.ones(60)
    views = (polar(np.radians(view), turn + np.pi) for view in (80, 60, 45))
    shown = (under_lamp(wr, polar(GRAZING, turn), irradiance=one, variance=0 * one) for wr in views)
    return needs_of(joined(list(shown)))


def one_place(relief: Relief, sigma_b: float) -> list[Truth]:
    """Pairs around the middle of ONE_TEXEL; wi - wr lies in the surface, at right angles to (u, v)."""
    u, v = (np.random.default_rng(3).uniform(*side, PAIRS) for side in ONE_TEXEL.region)
    found = []
    for w in np.linspace(*ONE_TEXEL.w, W_COUNT):
        half, across = np.c_[u, v, np.full(PAIRS, w)] / 2, np.c_[-v, u, 0 * u] / np.hypot(u, v)[:, None]
        apart = across * np.sqrt(1 - (half**2).sum(axis=1))[:, None]
        found.append(truth(relief, sigma_b, half + apart, half - apart))
    return found


def skin(rows: int = 128, cols: int = 128, relief_m: float = 200e-9, bump_m: float = 400e-9) -> np.ndarray:
    """Heights (rows, cols) of periodic bumps, the lowest at 0, smoothed by a Gaussian of standard deviation bump_m."""
    q_y, q_x = np.fft.fftfreq(rows, PIXEL_M)[:, None], np.fft.fftfreq(cols, PIXEL_M)
    spectrum = np.fft.fft2(np.random.default_rng(0).standard_normal((rows, cols)))
    height = np.fft.ifft2(spectrum * np.exp(-2 * (np.pi * bump_m) ** 2 * (q_y**2 + q_x**2))).real
    return relief_m * (height - height.min()) / np.ptp(height)


def scan(height_m: np.ndarray, pixel_m: tuple[float, float] = (PIXEL_M, PIXEL_M), periodic: bool = False) -> HeightMap:
    """A height map of heights in metres, as from a microscope."""
    return HeightMap(height_m, pixel_m, "the scan", periodic=periodic)


def tilted() -> HeightMap:
    """A surface that rises from one side to the other by five times its relief."""
    y, x = np.indices((128, 128)) / 127
    return scan(skin() + 1e-6 * x - 0.3e-6 * y)


def holed() -> HeightMap:
    """A surface with 2 % of its pixels missing, and a hole of 12 x 10 pixels."""
    height = skin()
    height[np.random.default_rng(1).random(height.shape) < 0.02] = np.nan
    height[40:52, 70:80] = np.nan
    return scan(height)


def dusty() -> HeightMap:
    """A relief of 200 nm with three grains of dust, 1 um high and 380 nm wide."""
    height = skin()
    y, x = np.indices(height.shape)
    for row, col in ((31, 90), (77, 40), (100, 101)):
        height += 1e-6 * np.exp(-((y - row) ** 2 + (x - col) ** 2) / (2 * 2.0**2))
    return scan(height)


def stepped(step_m: float) -> HeightMap:
    """Heights rounded to multiples of step_m."""
    return scan(np.round(skin() / step_m) * step_m)


def lines(period_m: float, depth_m: float, samples: int, periods: int) -> HeightMap:
    """A periodic sinusoidal grating, a few rows high."""
    return sinusoidal(period_m, depth_m, periods=periods, samples_per_period=samples, rows=8)


def albedo(relief: Relief, baked: Table) -> dict[str, float]:
    """The largest albedo for light along the scan's x axis at 75, 80 and 85 degrees, of luminance: of keratin, and of a
    perfect mirror."""
    mirror = make([relief], BakeRequest(coherence_length_m=COHERENCE_M, matter=MIRRORING)).table
    return {
        f"albedo of {name}": max(float(directional_albedo_xyz(table, np.radians(angle))[1]) for angle in (75, 80, 85))
        for name, table in (("keratin", baked), ("a mirror", mirror))
    }


def zero_order(relief: Relief, baked: Table) -> dict[str, float]:
    """The largest error of the zero order's luminance over all w, against J_0(pi w depth / lambda)^2."""
    lambdas, w = wavelengths(1e-9), np.linspace(0, 2, 21)
    weights = spectral_weights(lambdas, baked.illuminant)[:, 1]
    turns = np.pi * w[:, None] / lambdas * relief.height_range_m
    exact = np.array([[chebyshev.bessel_j(each, 1)[0] ** 2 for each in row] for row in turns]) @ weights
    return {"zero order against J0^2": float(np.abs(baked.zero_order_xyz(w)[:, 1] - exact).max())}


def brightest(relief: Relief, baked: Table) -> dict[str, float]:
    """Y / w^2 of the brightest texel, at w = 1."""
    return {"brightest Y / w^2": float(np.abs(baked.at_w(1.0)[..., 1]).max())}


def evanescent(relief: Relief, baked: Table) -> dict[str, float]:
    """The largest scattered Y over all views along T, for light along the normal and at 80 degrees."""
    found = {}
    for name, angle in (("light at 0 degrees", 0.0), ("light at 80 degrees", 80.0)):
        view = np.linspace(-89, 89, 400)
        u = np.sin(np.radians(angle)) + np.sin(np.radians(view))
        w = np.cos(np.radians(angle)) + np.cos(np.radians(view))
        found[f"Y, {name}"] = float((baked.scattered_over_w2(u, np.zeros(400), w)[:, 1] * w**2).max())
    return found


def fewer_wavelengths(relief: Relief, baked: Table) -> dict[str, float]:
    """The largest error of Y along T for u from 1.7 to 1.95, over the largest Y; also with half the wavelengths."""
    chosen = plan(relief, BakeRequest(coherence_length_m=LONG_M))
    half = carry_out(replace(chosen, wavelengths=chosen.wavelengths[::2]))
    u, w = np.linspace(1.7, 1.95, 200), 0.3
    exact = reference_xyz(relief, (u, 0 * u), w=w, sigma_b=baked.sigma_b, step_m=wavelength_step(baked.sigma_b) / 2)[0][
        :, 1
    ]
    ripple = [np.abs(each.scattered_over_w2(u, 0 * u, w)[:, 1] * w**2 - exact).max() for each in (baked, half)]
    found = {"wavelengths": float(len(chosen.wavelengths)), "off near the rim": ripple[0] / exact.max()}
    return {**found, "with half of them": ripple[1] / exact.max()}


@dataclass(frozen=True)
class Case:
    """A surface and the coherence length of its bake; None lets the bake choose the length.

    The bake is compared with the reference of `same_as` (None: the surface itself) on the pairs of `truths`. `figures`
    gives further figures of the bake by name, and `needs` is the requested part of (u, v, w)."""

    name: str
    asked: str
    surface: Callable[[], HeightMap]
    coherence_m: float | None = COHERENCE_M
    same_as: Callable[[], HeightMap] | None = None
    truths: Truths = anywhere
    figures: Callable[[Relief, Table], dict[str, float]] | None = None
    needs: Needs = EVERYTHING


@dataclass(frozen=True)
class Outcome:
    """The errors and further figures of a case, or the reason for refusing it."""

    errors: Errors | None = None
    figures: dict[str, float] | None = None
    refusal: str = ""

    def as_dict(self) -> dict:
        """The outcome as JSON."""
        errors = None if self.errors is None else self.errors.as_dict()
        return {"errors": errors, "figures": self.figures or {}, "refusal": self.refusal or None}

    @property
    def text(self) -> str:
        """The case's cell in the table."""
        if self.refusal:
            return f"refused: {self.refusal}"
        more = "".join(f"; {name} {value:.3g}" for name, value in (self.figures or {}).items())
        return f"dE00 {self.errors.p99:.2f}, dY {self.errors.relative_dy:.2%}{more}"


CASES = (
    Case("relief of 1 um", "bumps of 400 nm", lambda: scan(skin(96, 96, 1e-6))),
    Case("relief of 2 um", "bumps of 400 nm", lambda: scan(skin(96, 96, 2e-6))),
    Case("theta of 89.9 degrees", "light there, views at 26, 73 and 89.9", lambda: scan(skin()), truths=grazing,
         figures=albedo),
    Case("u = v = 0", "mirror views of a sinusoidal grating", lambda: lines(2.56e-6, 150e-9, 32, 2), truths=mirrored,
         figures=zero_order),
    Case("flat", "zeros", lambda: scan(np.zeros((96, 96)))),
    Case("flat, tilted", "1 um over the scan", lambda: scan(np.tile(np.linspace(0, 1e-6, 96), (96, 1)))),
    Case("one row", "128 pixels", lambda: scan(skin()[:1])),
    Case("one column", "128 pixels, automatic coherence", lambda: scan(skin()[:, :1]), None),
    Case("32 x 32", "automatic coherence", lambda: scan(skin()[:32, :32]), None),
    Case("1 x 1", "a pixel", lambda: scan(np.zeros((1, 1))), None),
    Case("2 x 2", "four pixels", lambda: scan(np.array([[0, 1e-7], [2e-7, 0]])), None),
    Case("1 x 1 that wraps", "a mirror", lambda: scan(np.zeros((1, 1)), periodic=True), None),
    Case("non-square pixels", "80 x 160 nm, against 80 x 80 nm",
         lambda: scan(skin()[:, ::2], (PIXEL_M, 2 * PIXEL_M), periodic=True),
         same_as=lambda: scan(skin(), periodic=True)),
    Case("NaN holes", "2 % of pixels and 12 x 10 more missing, against none", holed, same_as=lambda: scan(skin())),
    Case("nothing but NaN", "no pixel measured", lambda: scan(np.full((32, 32), np.nan))),
    Case("dust 5 x the relief", "three grains of 1 um on 200 nm", dusty),
    Case("tilt 5 x the relief", "1 um over the scan, against none", tilted, same_as=lambda: scan(skin())),
    Case("8-bit steps", "0.8 nm of 200 nm, against none", lambda: stepped(200e-9 / 255), same_as=lambda: scan(skin())),
    Case("8-bit steps, range wasted", "7.8 nm of 200 nm, against none", lambda: stepped(2e-6 / 255),
         same_as=lambda: scan(skin())),
    Case("period under the shortest wavelength", "250 nm, coherence 4 um", lambda: lines(250e-9, 60e-9, 4, 32),
         4e-6, truths=beyond, figures=evanescent),
    Case("period longer than the patch", "24 um in 10 um",
         lambda: scan(np.tile(100e-9 * np.sin(2 * np.pi * np.arange(128) / 300), (128, 1)))),
    Case("coherence longer than the patch", "20 um of 10 um", lambda: scan(skin()), 20e-6),
    Case("coherence longer than a patch that wraps", "20 um of 10 um",
         lambda: lines(2.56e-6, 150e-9, 32, 4), 20e-6),
    Case("coherence under a wavelength", "0.2 um", lambda: scan(skin()), 0.2e-6),
    Case("orders narrower than the wavelength step", "lines of 320 nm, coherence 40 um",
         lambda: lines(320e-9, 60e-9, 4, 32), LONG_M, figures=fewer_wavelengths),
    Case("half-float overflow", "300 nm of lines, coherence 40 um", lambda: lines(2.5e-6, 300e-9, 32, 4), LONG_M,
         figures=brightest),
    Case("needs of one texel", "u, v and w 0.02 wide", lambda: scan(skin()), truths=one_place, needs=ONE_TEXEL),
    Case("needs of a lamp at the horizon", "light at 89.9 degrees, views at 45 to 80", lambda: scan(skin()),
         truths=horizon, needs=horizon_needs()),
    Case("half-float underflow", "relief of 0.05 nm", lambda: scan(skin(relief_m=0.05e-9)), figures=brightest),
)  # fmt: skip


def as_baked(relief: Relief, coherence_m: float | None, needs: Needs = EVERYTHING) -> Table:
    """The table that a bake's file would hold."""
    return make([relief], BakeRequest(coherence_length_m=coherence_m, needs=needs)).table


def outcome(case: Case, baker: Baker = as_baked) -> Outcome:
    """Bake a case and measure it against its reference."""
    try:
        relief = prepare(case.surface())
        baked = baker(relief, case.coherence_m, case.needs)
    except GratingError as refusal:
        return Outcome(refusal=str(refusal))
    exact = prepare(case.same_as()) if case.same_as else relief
    errors = measure(case.truths(exact, baked.sigma_b), baked.candidate)
    return Outcome(errors, case.figures(relief, baked) if case.figures else None)


def main(argv: list[str] | None = None) -> None:
    """Print what each case gives."""
    parser = OneLineParser(prog="./dev bench hard_cases", description="Surfaces that are hard.")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    outcomes = []
    for case in CASES:
        outcomes.append(outcome(case))
        report.say(f"{case.name:<42} {case.asked:<52} {outcomes[-1].text}", arguments.json)
    cases = zip(CASES, outcomes, strict=True)
    facts = [{"case": case.name, "asked": case.asked, **each.as_dict()} for case, each in cases]
    report.write({"cases": facts}, arguments.json)
