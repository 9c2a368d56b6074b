# SPDX-License-Identifier: GPL-3.0-or-later
"""Which period a method's colours tell of (thesis Algorithm 6): its response over wavelength and viewing angle.

The light comes from -T at theta_i, as in the BRDF maps, and the view moves in the plane of incidence, over the first
order. Viewing angles are the thesis's, theta_v = asin(lambda / d - sin theta_i), negative on the side away from the
light, so that

    u = -(sin theta_i + sin theta_v),   w = cos theta_i + cos theta_v,   v = 0.

The response is the density over (u, v) alone; R and O, which are smooth and the same for all methods, are left out.
The peak of a wavelength is the vertex of the parabola through the logarithms of the highest sample and its neighbours
in u, exact for a Gaussian order; a period is lambda / |u_peak|.
"""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from . import chebyshev, plots
from .colour import observer, spectral_weights, white_xyz
from .failure import GratingError
from .height_map import HeightMap
from .methods import METHODS, Method, Settings
from .methods.baked import Baked
from .methods.exact import Ensemble, Patch
from .methods.method import THESIS_COHERENCE_M
from .reference import KERNEL_REACH, reference_grid, wavelengths
from .relief import Relief
from .resample import Resampler
from .series import spectrum_series
from .spectrum import phasor

# Methods with an axis of wavelength that differ in it, the references first.
DEFAULT_METHODS = ("reference", "reference-patch", "flss", "chebyshev", "nmm", "pq", "pq-printed", "stam")
ANGLE_STEP = np.radians(0.02)
# A peak is looked for where u is that of the first order of the period, to this share.
WINDOW = 0.25
# Interpolation of the references in s; their methods' own direct sums agree to the same (a test).
_EXACT = 1e-10
# Colours of the first order are compared where Y is at least this share of its greatest.
_BRIGHT = 0.1


@dataclass(frozen=True)
class Plane:
    """Views in the plane of incidence: light at theta_i, views at theta_v (n,), ascending, all in radians."""

    theta_i: float
    theta_v: np.ndarray

    @property
    def u(self) -> np.ndarray:
        """Along T (n,), descending: the light is on the side of -T."""
        return -(np.sin(self.theta_i) + np.sin(self.theta_v))

    @property
    def w(self) -> np.ndarray:
        """Along the normal (n,)."""
        return np.cos(self.theta_i) + np.cos(self.theta_v)


def first_order_angle(theta_i: float, lambdas_m, period_m: float) -> np.ndarray:
    """theta_v (n,) in radians of the first order. Raises GratingError where there is none above the horizon."""
    sine = np.asarray(lambdas_m) / period_m - np.sin(theta_i)
    if np.any(np.abs(sine) >= 1):
        raise GratingError(
            f"a period of {period_m * 1e9:.0f} nm has no first order at {np.max(lambdas_m) * 1e9:.0f} nm with the "
            f"light at {np.degrees(theta_i):.1f} degrees; give another --theta-i or --period-nm"
        )
    return np.arcsin(sine)


def first_order_plane(theta_i: float, lambdas_m: np.ndarray, period_m: float, step: float = ANGLE_STEP) -> Plane:
    """Views `step` radians apart, over the windows of all wavelengths.

    They are odd multiples of half a step, whatever the period, so that no expected angle is among them but by chance: a
    grid that held them would give the asked period back."""
    first_order_angle(theta_i, lambdas_m, period_m)
    reach = np.array([(1 - WINDOW) * np.min(lambdas_m), (1 + WINDOW) * np.max(lambdas_m)]) / period_m
    low, high = np.arcsin(np.clip(reach - np.sin(theta_i), -1, 1))
    high = min(high, np.pi / 2 - step)
    return Plane(theta_i, (np.arange(np.floor(low / step), np.ceil(high / step)) + 0.5) * step)


def response(method: Method, plane: Plane, lambdas_m: np.ndarray) -> np.ndarray:
    """Density over (u, v) (wavelengths, views)."""
    if isinstance(method, Ensemble):
        return _ensemble_response(method, plane, lambdas_m)
    if isinstance(method, Patch):
        return _patch_response(method, plane, lambdas_m)
    zeros = np.zeros(len(plane.theta_v))
    return np.stack([method.density(plane.u, zeros, plane.w, lam) for lam in lambdas_m])


def _ensemble_response(method: Ensemble, plane: Plane, lambdas_m) -> np.ndarray:
    """The reference's density with its spectra interpolated in s: every view has its own w, and one transform for each
    view and wavelength would take hours."""
    sigma = method.sigma_b
    grid = reference_grid(method.relief, sigma)
    reach = KERNEL_REACH * sigma / np.min(lambdas_m)
    grid = replace(grid, q_y=grid.q_y[np.abs(grid.q_y) <= reach])
    series = spectrum_series(method.relief, grid, plane.w.max() / np.min(lambdas_m), _EXACT)
    ascending = plane.u[::-1]
    rows = []
    for lam in lambdas_m:
        resample = Resampler(grid, ascending, np.zeros(1), lam, sigma)
        weights = series.weights(plane.w / lam) * (plane.w / lam)[:, None] ** 2
        blurred = np.stack([resample(power[resample.kept])[0, ::-1] for power in series.scattered_over_s2], axis=-1)
        kernel = np.exp(-0.5 * (plane.u / sigma) ** 2) / (2 * np.pi * sigma**2)
        # Interpolation leaves some 1e-10 of the peak below zero.
        scattered = np.maximum(np.sum(weights * blurred, axis=-1), 0)
        rows.append(scattered + series.zero_order(plane.w / lam) * kernel)
    return np.stack(rows)


def _patch_response(method: Patch, plane: Plane, lambdas_m) -> np.ndarray:
    """The patch's density with its amplitudes interpolated in s, in which they are band limited by the relief."""
    window, relief = method.window, method.window.relief
    s_max = plane.w.max() / np.min(lambdas_m)
    count = chebyshev.jacobi_anger_terms(np.pi * s_max * relief.height_range_m, _EXACT)
    along_b = window.waves(0, np.zeros(1))[0]
    lines = np.stack(
        [along_b @ (relief.taper * phasor(relief.height_m, s)) for s in chebyshev.nodes(count, 0, s_max)], axis=-1
    )
    rows = []
    for lam in lambdas_m:
        weights = chebyshev.interpolation_matrix(plane.w / lam, count, 0, s_max)
        amplitude = np.sum(window.waves(1, plane.u / lam) @ lines * weights, axis=-1)
        rows.append(window.density_scale() * np.abs(amplitude) ** 2 / lam**2)
    return np.stack(rows)


def peak(position: np.ndarray, values: np.ndarray) -> float:
    """Where values (n,) >= 0 at ascending or descending positions (n,) are greatest, between the samples.

    The vertex of the parabola through three logarithms; the sample itself at an end or beside a dark neighbour, where
    NMM cuts an order off; NaN if all is dark."""
    k = int(np.argmax(values))
    if not values[k] > 0:
        return float("nan")
    near = slice(k - 1, k + 2)
    if k == 0 or k == len(values) - 1 or np.any(values[near] <= 0):
        return float(position[k])
    x, y = position[near] - position[k], np.log(values[near] / values[k])
    slopes = y[[0, 2]] / x[[0, 2]]
    bend = (slopes[1] - slopes[0]) / (x[2] - x[0])
    # Three equal samples are a plateau, whose middle is its peak.
    return float(position[k] if bend == 0 else position[k] - (slopes[0] - bend * x[0]) / (2 * bend))


@dataclass(frozen=True)
class Evaluation:
    """What one method's response says of the period. `expected_m` is the period that angles are held against."""

    name: str
    plane: Plane
    lambdas_m: np.ndarray
    response: np.ndarray
    peak_u: np.ndarray
    expected_m: float
    seconds: float

    @property
    def periods_m(self) -> np.ndarray:
        """lambda / |u_peak| (wavelengths,)."""
        return self.lambdas_m / np.abs(self.peak_u)

    @property
    def peak_angles(self) -> np.ndarray:
        """theta_v of the peaks (wavelengths,), radians."""
        return np.arcsin(-self.peak_u - np.sin(self.plane.theta_i))

    @property
    def expected_angles(self) -> np.ndarray:
        """theta_v (wavelengths,) of the grating equation, radians."""
        return first_order_angle(self.plane.theta_i, self.lambdas_m, self.expected_m)

    def as_dict(self) -> dict[str, float]:
        """The figures in nanometres and degrees: mean, population variance, rms of the angles."""
        off = np.degrees(self.peak_angles - self.expected_angles)
        return {
            "period_mean_nm": float(np.mean(self.periods_m) * 1e9),
            "period_variance_nm": float(np.var(self.periods_m * 1e9)),
            "peak_angle_rms_deg": float(np.sqrt(np.mean(off**2))),
            "seconds": self.seconds,
        }


def evaluate_method(
    name: str,
    relief: Relief,
    settings: Settings,
    theta_i: float,
    around_m: float,
    expected_m: float | None = None,
    lambdas_m: np.ndarray | None = None,
    step: float = ANGLE_STEP,
) -> Evaluation:
    """Evaluate one of METHODS over a relief: peaks around the period around_m, angles against expected_m (None: the
    method's own mean). Raises GratingError for a method without spectrum, or one that leaves a wavelength dark."""
    started = time.perf_counter()
    lambdas_m = wavelengths(5e-9) if lambdas_m is None else lambdas_m
    plane = first_order_plane(theta_i, lambdas_m, around_m, step)
    found = response(METHODS[name](relief, settings), plane, lambdas_m)
    order = np.abs(plane.u) * around_m / lambdas_m[:, None]
    inside = np.abs(order - 1) <= WINDOW
    peak_u = np.array([peak(plane.u[at], row[at]) for at, row in zip(inside, found, strict=True)])
    if np.any(np.isnan(peak_u)):
        raise GratingError(f"{name}: dark around the first order of {around_m * 1e9:.0f} nm; give --period-nm")
    expected_m = expected_m or float(np.mean(lambdas_m / np.abs(peak_u)))
    return Evaluation(name, plane, lambdas_m, found, peak_u, expected_m, time.perf_counter() - started)


def thesis_settings(**changes) -> Settings:
    """Settings of an evaluation: 65 um of coherence under both models, the steps of the thesis."""
    return Settings(**{"coherence_length_m": THESIS_COHERENCE_M, **changes})


def turned(height_map: HeightMap, azimuth_deg: int) -> HeightMap:
    """The height map turned so that light from azimuth_deg (a multiple of 90, from T towards B) comes from 180."""
    quarters = (180 - azimuth_deg) // 90
    size = height_map.pixel_size_m if quarters % 2 == 0 else height_map.pixel_size_m[::-1]
    return replace(height_map, height_m=np.rot90(height_map.height_m, quarters), pixel_size_m=size)


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


def plot(path: Path, evaluations: Sequence[Evaluation], title: str = "") -> None:
    """One panel for each method: response, the grating equation's curve and the peaks. Raises GratingError without
    matplotlib."""
    pyplot = plots.pyplot()
    columns = min(4, len(evaluations))
    rows = -(-len(evaluations) // columns)
    size = (3.3 * columns + 0.6, 2.9 * rows + 0.5)
    figure, panels = pyplot.subplots(rows, columns, figsize=size, sharey=True, squeeze=False, layout="constrained")
    for panel in panels.flat[len(evaluations) :]:
        panel.set_axis_off()
    for panel, one in zip(panels.flat, evaluations, strict=False):
        nm = one.lambdas_m * 1e9
        # Square roots show the faint flanks; each panel has its own brightness.
        panel.pcolormesh(nm, np.degrees(one.plane.theta_v), np.sqrt(one.response).T, rasterized=True, cmap="viridis")
        panel.plot(nm, np.degrees(one.peak_angles), "r-", linewidth=2, label="peaks")
        panel.plot(nm, np.degrees(one.expected_angles), "w--", linewidth=1, label="grating equation")
        figures = one.as_dict()
        mean, variance = figures["period_mean_nm"], figures["period_variance_nm"]
        panel.set_title(f"{one.name}: {mean:.2f} nm, variance {variance:.3g}", fontsize=9)
    panels[0, 0].legend(loc="lower right", fontsize=8, facecolor="0.5")
    figure.supxlabel("wavelength, nm", fontsize=9)
    figure.supylabel("viewing angle, degrees", fontsize=9)
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
