# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates the period implied by a method's response (thesis Algorithm 6).

For each wavelength a parabola through the logarithms of the highest sample and its neighbours gives the peak in u; this
is exact for a Gaussian order. The period is then lambda / |u_peak|."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from precompute.base.failure import GratingError
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.optics.coherence import THESIS_COHERENCE_M
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import Relief

from . import plots
from .response import WINDOW, FirstOrder, Plane, first_order_angle, response


def peak(position: np.ndarray, values: np.ndarray) -> float:
    """The position of the maximum of values (n,) >= 0 at ascending or descending positions (n,), found between samples.

    It is the vertex of the parabola through the logarithms of the highest sample and its neighbours. At an end, or
    beside a dark neighbour (NMM cuts orders off), it is the position of the highest sample. NaN if all values are 0."""
    k = int(np.argmax(values))
    if not values[k] > 0:
        return float("nan")
    near = slice(k - 1, k + 2)
    if k == 0 or k == len(values) - 1 or np.any(values[near] <= 0):
        return float(position[k])
    x, y = position[near] - position[k], np.log(values[near] / values[k])
    slopes = y[[0, 2]] / x[[0, 2]]
    bend = (slopes[1] - slopes[0]) / (x[2] - x[0])
    # Three equal samples are a plateau; its middle is the peak.
    return float(position[k] if bend == 0 else position[k] - (slopes[0] - bend * x[0]) / (2 * bend))


@dataclass(frozen=True)
class Evaluation:
    """One method's response and its peaks. Their angles are compared with those of a grating of period `expected_m`."""

    name: str
    plane: Plane
    lambdas_m: np.ndarray
    response: np.ndarray
    peak_u: np.ndarray
    expected_m: float
    seconds: float

    @property
    def periods_m(self) -> np.ndarray:
        """Periods (wavelengths,) from the peaks: lambda / |u_peak|."""
        return self.lambdas_m / np.abs(self.peak_u)

    @property
    def peak_angles(self) -> np.ndarray:
        """Viewing angles theta_v (wavelengths,) of the peaks, in radians."""
        return np.arcsin(-self.peak_u - np.sin(self.plane.theta_i))

    @property
    def expected_angles(self) -> np.ndarray:
        """Viewing angles theta_v (wavelengths,) by the grating equation, in radians."""
        return first_order_angle(self.plane.theta_i, self.lambdas_m, self.expected_m)

    def as_dict(self) -> dict[str, float]:
        """A record for JSON: mean (nm) and population variance (nm^2) of periods, rms error of angles (degrees)."""
        off = np.degrees(self.peak_angles - self.expected_angles)
        return {
            "period_mean_nm": float(np.mean(self.periods_m) * 1e9),
            "period_variance_nm": float(np.var(self.periods_m * 1e9)),
            "peak_angle_rms_deg": float(np.sqrt(np.mean(off**2))),
            "seconds": self.seconds,
        }

    def summary(self) -> str:
        """The row of the printed table, without the method's name."""
        one = self.as_dict()
        return (
            f"{one['period_mean_nm']:>10.3f} {one['period_variance_nm']:>9.4f} "
            f"{one['peak_angle_rms_deg']:>10.5f} {self.seconds:>8.2f}"
        )


def evaluate_method(
    name: str, relief: Relief, settings: Settings, *, first_order: FirstOrder, expected_m: float | None = None
) -> Evaluation:
    """Evaluate one of METHODS on a relief, looking for peaks around the period of `first_order`.

    Angles are compared with those of a grating of period `expected_m`; None stands for the mean of the found periods.
    Raises GratingError for a method without spectrum, or if a wavelength is dark."""
    started = time.perf_counter()
    lambdas_m, around_m, plane = first_order.lambdas_m, first_order.period_m, first_order.plane
    found = response(METHODS[name](relief, settings), plane, lambdas_m)
    order = np.abs(plane.u) * around_m / lambdas_m[:, None]
    inside = np.abs(order - 1) <= WINDOW
    peak_u = np.array([peak(plane.u[at], row[at]) for at, row in zip(inside, found, strict=True)])
    if np.any(np.isnan(peak_u)):
        raise GratingError(name, f"dark around the first order of {around_m * 1e9:.0f} nm", "give --period-nm")
    return Evaluation(
        name=name,
        plane=plane,
        lambdas_m=lambdas_m,
        response=found,
        peak_u=peak_u,
        expected_m=expected_m or float(np.mean(lambdas_m / np.abs(peak_u))),
        seconds=time.perf_counter() - started,
    )


def thesis_settings(**changes) -> Settings:
    """Settings of an evaluation: the thesis's coherence length of 65 um, then `changes`."""
    return Settings(**{"coherence_length_m": THESIS_COHERENCE_M, **changes})


def turned(height_map: HeightMap, azimuth_deg: int) -> HeightMap:
    """Turn the map so that light from azimuth_deg (a multiple of 90, from T towards B) comes from 180 degrees."""
    quarters = (180 - azimuth_deg) // 90
    size = height_map.pixel_size_m if quarters % 2 == 0 else height_map.pixel_size_m[::-1]
    return replace(height_map, height_m=np.rot90(height_map.height_m, quarters), pixel_size_m=size)


def plot(path: Path, evaluations: Sequence[Evaluation], title: str = "") -> None:
    """Write a plot with one panel for each method: response, peaks, and the curve of the grating equation.

    Raises GratingError if matplotlib is not installed."""
    pyplot = plots.pyplot()
    columns = min(4, len(evaluations))
    rows = -(-len(evaluations) // columns)
    size = (3.3 * columns + 0.6, 2.9 * rows + 0.5)
    figure, panels = pyplot.subplots(rows, columns, figsize=size, sharey=True, squeeze=False, layout="constrained")
    for panel in panels.flat[len(evaluations) :]:
        panel.set_axis_off()
    for panel, one in zip(panels.flat, evaluations, strict=False):
        nm = one.lambdas_m * 1e9
        # The square root shows faint flanks. Each panel has its own brightness scale.
        panel.pcolormesh(nm, np.degrees(one.plane.theta_v), np.sqrt(one.response).T, rasterized=True, cmap="viridis")
        panel.plot(nm, np.degrees(one.peak_angles), "r-", linewidth=2, label="peaks")
        panel.plot(nm, np.degrees(one.expected_angles), "w--", linewidth=1, label="grating equation")
        told = one.as_dict()
        mean, variance = told["period_mean_nm"], told["period_variance_nm"]
        panel.set_title(f"{one.name}: {mean:.2f} nm, variance {variance:.3g}", fontsize=9)
    panels[0, 0].legend(loc="lower right", fontsize=8, facecolor="0.5")
    figure.supxlabel("wavelength, nm", fontsize=9)
    figure.supylabel("viewing angle, degrees", fontsize=9)
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)
