# SPDX-License-Identifier: GPL-3.0-or-later
"""Terms against error: where the Taylor series of the phasor fails, and how many terms the Chebyshev series needs.

The error is the rms over the relief of the difference between the sum and exp(-i 2 pi s h). It is taken at 380 nm with
light and view along the normal (s = 2 / lambda, the largest s possible), in float32 like a shader's sums.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from precompute.colour.observer import S_MAX
from precompute.methods import chebyshev_series, flss
from precompute.methods.term_images import Expansion

from . import plots

RELIEFS_NM = (50, 100, 150, 250, 400, 600, 800, 1000, 1400, 2000)
TOLERANCE = 1e-3
# e z + 60 for 2 um of relief. With more terms the error of every series is rounding alone.
TERMS_MAX = 240
_SAMPLES = 2001


@dataclass(frozen=True)
class Series:
    """One expansion in one arrangement; make(relief_m, terms) builds it over heights from -relief/2 to relief/2."""

    name: str
    make: Callable[[float, int], Expansion]
    style: str

    def curve(self, relief_m: float, dtype: type) -> np.ndarray:
        """rms phasor error (TERMS_MAX,) after 1, 2, ... terms."""
        return phasor_errors(self.make(relief_m, TERMS_MAX), relief_m, dtype)


def taylor(relief_m: float, terms: int) -> Expansion:
    """The Taylor series as in the thesis, with heights from the lowest point."""
    return flss.Taylor(terms, -relief_m / 2, relief_m)


def taylor_centred(relief_m: float, terms: int) -> Expansion:
    """The Taylor series with heights from the middle."""
    return flss.Taylor(terms, 0.0, relief_m / 2)


def chebyshev(relief_m: float, terms: int) -> Expansion:
    """The Chebyshev series (Jacobi-Anger)."""
    return chebyshev_series.Chebyshev(terms, 0.0, relief_m / 2)


SERIES = (
    Series("Taylor", taylor, "C3-"),
    Series("Taylor, centred", taylor_centred, "C1--"),
    Series("Chebyshev", chebyshev, "C0-"),
)


def phasor_errors(expansion: Expansion, relief_m: float, dtype: type = np.float32) -> np.ndarray:
    """rms error over the heights of each partial sum (terms,), with terms, coefficients and sums all in dtype.

    Each series is compared with the phasor relative to its own origin, as a power spectrum ignores the origin."""
    narrow = np.complex64 if dtype == np.float32 else np.complex128
    height = np.linspace(-relief_m / 2, relief_m / 2, _SAMPLES)
    origin = getattr(expansion, "origin_m", 0.0)
    exact = np.exp((-2j * np.pi * S_MAX) * (height - origin))
    coefficients = expansion.coefficients(np.array([S_MAX]))[0]
    total = np.zeros(_SAMPLES, narrow)
    errors = []
    for coefficient, field in zip(coefficients, expansion.fields(height), strict=True):
        total = total + narrow(coefficient) * field.astype(narrow)
        errors.append(np.sqrt(np.mean(np.abs(total - exact) ** 2)))
    return np.array(errors)


def table(dtype: type = np.float32) -> list[dict[str, float | int | str | None]]:
    """A row for each relief and series: error with TERMS_MAX terms, terms to TOLERANCE (None: never), expected loss."""
    rows = []
    for relief_nm in RELIEFS_NM:
        for series in SERIES:
            errors = series.curve(relief_nm * 1e-9, dtype)
            reached = errors <= TOLERANCE
            rows.append(
                {
                    "relief_nm": relief_nm,
                    "series": series.name,
                    "error": float(errors[-1]),
                    "terms": int(np.argmax(reached)) + 1 if reached.any() else None,
                    "expected_loss": _expected_loss(series, relief_nm * 1e-9, dtype),
                }
            )
    return rows


def _expected_loss(series: Series, relief_m: float, dtype: type) -> float | None:
    expansion = series.make(relief_m, 1)
    return flss.expected_loss(2 * np.pi * S_MAX * expansion.scale_m, dtype) if "Taylor" in series.name else None


def plot(path: Path, dtype: type = np.float32) -> None:
    """Plot error against terms: six panels, one for each relief, with every series in each."""
    pyplot = plots.pyplot()
    shown = (150, 250, 400, 600, 1000, 2000)
    figure, panels = pyplot.subplots(2, 3, figsize=(12, 7), sharex=True, sharey=True, layout="constrained")
    terms = np.arange(1, TERMS_MAX + 1)
    for panel, relief_nm in zip(panels.flat, shown, strict=True):
        for series in SERIES:
            errors = series.curve(relief_nm * 1e-9, dtype)
            panel.semilogy(terms, np.minimum(errors, 1e9), series.style, label=series.name)
        panel.axhline(TOLERANCE, color="0.6", linewidth=0.8)
        panel.axhline(1, color="k", linewidth=0.8)
        panel.set_title(f"{relief_nm} nm of relief")
        panel.set_ylim(1e-8, 1e8)
        panel.set_xlim(0, 120)
        panel.grid(alpha=0.3)
    for panel in panels[1]:
        panel.set_xlabel("terms")
    for panel in panels[:, 0]:
        panel.set_ylabel("rms phasor error")
    panels[0, 0].legend()
    figure.suptitle(f"Phasor at 380 nm, normal incidence and view, {np.dtype(dtype).name}; above 1 it is noise")
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
