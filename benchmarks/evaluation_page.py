# SPDX-License-Identifier: GPL-3.0-or-later
"""The text of docs/evaluation.md. benchmarks.evaluation computes the numbers in it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks import terms

COLUMNS = 4


@dataclass(frozen=True)
class Facts:
    """The facts that the page reports.

    They are: whether Elaphe is the real scan; the rows of each surface; the bakes' colours; the variance of the
    blaze's period where peaks are samples of a grid; the periods of the pieces of Elaphe in nanometres; the rows of
    the table of terms."""

    scan: bool
    tables: dict[str, list]
    bakes: dict
    grid_variance: float
    patches: list[float]
    terms: list[dict]

    def as_dict(self) -> dict:
        """The facts for JSON."""
        rows = {
            name: [{"label": row.label, "thesis": row.thesis, **row.evaluation.as_dict()} for row in table]
            for name, table in self.tables.items()
        }
        bakes = {name: bake.as_dict() for name, bake in self.bakes.items()}
        return {**vars(self), "tables": rows, "bakes": bakes}


def text(facts: Facts, groups: dict) -> str:
    """The whole page."""
    parts = [
        INTRODUCTION.format(elaphe=SCAN if facts.scan else STAND_IN),
        "## The period found back (Algorithm 6)",
        HOW_PERIODS,
        "### Blaze, 2500 nm",
        period_table(facts.tables["blaze"], 2.5e-6),
        "![Response of the blaze](images/evaluation/response-blaze.png)",
        BLAZE.format(grid=facts.grid_variance),
        "### Elaphe",
        period_table(facts.tables["elaphe"]),
        "![Response of Elaphe](images/evaluation/response-elaphe.png)",
        (ELAPHE if facts.scan else ELAPHE_STAND_IN)
        + PIECES.format(
            low=min(facts.patches), high=max(facts.patches), mean=np.mean(facts.patches), spread=np.std(facts.patches)
        ),
        "### Xenopeltis-like, along the fingers",
        period_table(facts.tables["xenopeltis"]),
        "![Response of the Xenopeltis-like surface](images/evaluation/response-xenopeltis.png)",
        XENOPELTIS,
        "### The bake, which has no wavelengths",
        bake_table(facts.bakes),
        BAKE,
        "## BRDF maps: every method",
        MAPS,
        "### Blaze",
        map_table(groups["blaze"]),
        MAPS_BLAZE,
        "### Elaphe",
        map_table(groups["elaphe"]),
        MAPS_ELAPHE,
        "### Xenopeltis-like",
        map_table(groups["xenopeltis"]),
        MAPS_XENOPELTIS,
        "## Length of coherence, on the blaze",
        map_table(groups["coherence"]),
        COHERENCE,
        "## Wavelength step, on Elaphe",
        map_table(groups["steps"]),
        STEPS,
        "## Terms of the Taylor series, on Elaphe",
        map_table(groups["taylor"]),
        TAYLOR if facts.scan else "",
        map_table(groups["half"]),
        HALF if facts.scan else "",
        "```\n" + terms.as_text(facts.terms) + "\n```",
        "![Terms against error](images/evaluation/terms.png)",
        "## Angle of the light",
        map_table(groups["incidence"]),
        INCIDENCE,
        "## N slits (thesis 5.5, 5.6)",
        "![N slits](images/evaluation/slits.png)",
        SLITS,
        CREDIT,
    ]
    return "\n\n".join(part.strip("\n") for part in parts if part) + "\n"


def period_table(rows: Sequence, true_m: float | None = None) -> str:
    """The table of a surface's rows.

    It gives the mean and the variance of the period, and the rms error of the angles against the grating equation:
    with the method's own mean period and, where it is known, with the true period."""
    head = ["method", "period, nm", "variance, nm^2", "angle rms, degrees"]
    head += ["against the true period"] if true_m else []
    lines = [head + ["thesis, mean / variance", "s"]]
    for row in rows:
        own = row.evaluation.as_dict()
        cells = [row.label, f"{own['period_mean_nm']:.3f}", f"{own['period_variance_nm']:.4g}"]
        cells.append(f"{own['peak_angle_rms_deg']:.5f}")
        if true_m:
            cells.append(f"{replace(row.evaluation, expected_m=true_m).as_dict()['peak_angle_rms_deg']:.5f}")
        lines.append(cells + [row.thesis or "-", f"{own['seconds']:.1f}"])
    return table(lines)


def bake_table(bakes: dict) -> str:
    """The table that compares each surface's bake with its reference."""
    lines = [
        [
            "surface",
            "brightest, degrees",
            "the reference",
            "dominant wavelength, rms nm",
            "sum of abs dY / sum of Y",
        ]
    ]
    for name, one in bakes.items():
        off = one.dominant_wavelength_rms_nm
        lines.append(
            [
                name,
                f"{one.peak_angle_deg:.3f}",
                f"{one.reference_peak_angle_deg:.3f}",
                "none" if off is None else f"{off:.2f}",
                f"{one.relative_dy:.2%}",
            ]
        )
    return table(lines)


def map_table(maps: Sequence) -> str:
    """A table of pictures with captions. A caption also names the thesis's picture of the same map, where there is
    one."""
    cells = []
    for one in maps:
        beside = f"<br>thesis: `{one.thesis.removeprefix('brdfmap__')}`" if one.thesis else ""
        cells.append(f"![{one.caption}](images/evaluation/{one.name}.png)<br>{one.caption}{beside}")
    width = min(COLUMNS, len(cells))
    cells += [""] * (-len(cells) % width)
    lines = [cells[k : k + width] for k in range(0, len(cells), width)]
    return table([[""] * width, *lines])


def table(lines: Sequence[Sequence[str]]) -> str:
    """A Markdown table of lines of cells; the first line is the head."""
    head, *rest = lines
    marked = [head, ["---"] * len(head), *rest]
    return "\n".join("| " + " | ".join(line) + " |" for line in marked)


INTRODUCTION = """
# The thesis's evaluation, done again

M. Single's thesis (Bern 2014) evaluates its methods. This page repeats the evaluation with this project's methods. One
command makes every picture, number and table of the page:

    ./dev bench evaluation

The thesis's own pictures are not ours to publish. Below each of our pictures stands the name of its counterpart in the
thesis's public repository (simplay/Bachelor-Thesis). Where those pictures lie beside a checkout, the command also
writes sheets that show both to `docs/thesis_comparison`, which git ignores.

The blaze is `sample:blazed` (2.5 um, 246.23 nm, the thesis's numbers). {elaphe}
The thesis's scan of Xenopeltis unicolor is not public. In its place stands `sample:xenopeltis`, built to the published
period and relief.

**These results agree**: the blaze's period and angles by FLSS, NMM and PQ; the shape, the place and the order of the
colours of the blaze and of Elaphe by FLSS; the effect of coherence and of the wavelength step; the spread of PQ across
the orders.

**These results do not agree**: the exact period of Elaphe, which belongs to one patch's speckle; the number of Taylor
terms that Elaphe needs, where the thesis's pictures look like half of the relief; the vertical streak through the
thesis's maps of Elaphe, which raw edges draw; PQ on Elaphe; brightness, which the thesis leaves uncalibrated. The
sections below give a reason for each difference, or say that we do not know it.
"""

SCAN = "Elaphe is the thesis's own scan, 65 um wide, 375 nm from black to white."
STAND_IN = "The scan of Elaphe was missing when this page was made, and `sample:elaphe` takes its place."

HOW_PERIODS = """
The light comes at 75 degrees from -T. The first order is evaluated at 81 wavelengths from 380 to 780 nm, with 65 um of
coherence in both models. Views are 0.02 degrees apart, and no expected angle is among them. The peak of a wavelength is
the vertex of a parabola through the logarithms of the highest sample and its neighbours; the period is lambda / |u| of
the peak. The mean and the population variance are taken over the wavelengths. Peak angles are compared with the grating
equation for the method's own mean period. R and O are left out.

Compare FLSS, Chebyshev, NMM and PQ with `reference-patch` (one window on one patch). Compare Stam's form and the bake
with `reference` (the ensemble: the mean over all places of the window). In the plots the red line shows the peaks, and
the dashed line the grating equation. Brightness is the square root of the response, and each panel has its own scale.
"""

BLAZE = """
In the patch model the reference, FLSS, Chebyshev and NMM agree to 0.0001 nm. The two models agree to 0.001 nm. All
these periods are 0.4 nm under 2500, and 0.03 nm under it with light from the other side. The reason is that the order's
efficiency depends on w, and w on the viewing angle, so that the order is a little brighter on one of its sides. That is
the surface's physics and no error: with w held fixed the peaks give 2500.000. NMM's response is that of FLSS where the
grating equation holds to half a step, so its agreement is all but built in, here as in the thesis.

The thesis's mean of 2499.997 is met (with light from +T to 0.02 nm), and our variance is below its 0.377. A peak that
is the highest sample of a grid of angles, without a fit between samples, has a variance of {grid:.3f} square nanometres
at 0.017 degrees a step. The thesis's 0.377 is of that size: it comes from the grid and not from the optics.

PQ repeats one cell under a sharp aperture instead of a soft window, so that the cell's own transform pulls each order.
The period is 2502.5 nm if its sinc interpolation reads 21 x 21 texels, and 2501.8 nm with a shader's 3 x 3. The
thesis's 2502.428 / 0.390 is near the first of these. As printed, with the wrong product and a sum that runs one copy
too far, PQ scatters. The author's log in the repository holds another pair under the same name, 2491.86 / 248.04.
"""

ELAPHE = """
The thesis's 1144.26 nm is one number of many that this scan can give. The scan's first order is not a line but a comb
of speckle, as the thesis's own plot shows (`flss_elaphe`). It has stripes at many periods. The same stripe is the
brightest at all wavelengths, so that the *variance* is small, however arbitrary the *mean* is. The place of the window
decides which stripe is the brightest:

- With our apodisation, the window in the middle and light from -T, the period is about 1127 nm. With light from +T, at
  the other first order, it is 1182 nm.
- With the patch cut as in the thesis (raw edges, window on the patch's corner) and light from +T, the period is within
  2 nm of 1144.26. That is the nearest set-up that we found; we do not know the side of the thesis's light for certain.
- NMM that is told 1144.26 nm finds about 1139 nm: it only sees wavelengths within half a step of those that it is told.
- FLSS differs from its reference by a fifth of a nanometre. That is the price of 3 x 3 texels: with more texels it
  meets the reference (tests/precompute/methods/test_methods_patch.py). Chebyshev and Taylor images agree to a
  millionth.
- Stam's form knows the period that it is given (found in the relief by `info`) and nothing of the speckle.
- With 30 coherence areas the order from +T still has three summits, near 1029, 1146 and 1179 nm. At 580 nm their
  heights are within a seventh of each other. Under 440 nm the first summit is the brightest, above it the last: hence
  the variance in the last row.
- PQ as printed in the thesis gave 1052 / 49.7 and jumps between stripes. Our printed PQ does not jump on this side, and
  finds another stripe than PQ with the right product.
"""

ELAPHE_STAND_IN = """
This surface takes the place of the scan. Its period is not the scan's, and the thesis's numbers do not apply to it. One
thing holds for both: the first order of one patch is a comb of speckle, and one stripe of it is the brightest.
"""

PIECES = """
How much of the period is chance? The surface was cut into nine pieces, each as long as its coherence length. Their
periods run from {low:.0f} to {high:.0f} nm (mean {mean:.1f}, standard deviation {spread:.1f}). A rendered skin should
show an average over 30 coherence areas (the last rows of the table), and the bake takes that average by default.
"""

XENOPELTIS = """
The relief is 819 nm deep. At 380 nm the Taylor series in float32, which a shader has, loses all digits: its largest
term is some 10^10 times the sum. It is therefore refused, and the Taylor methods of the table ran in float64. Chebyshev
does not need that. The thesis evaluated its scan with 37 terms. At the full phase its phasor would be off by 3 (rms) at
380 nm; at half of the phase, which its maps of Elaphe suggest (below), it has converged. For this surface the log in
its repository says 1594.06 / 1.87, and the printed table 1552.27 / 0.45. Our surface was built with a period of 1552 nm
and a random ground. It gives that period to within the few nanometres of its speckle.
"""

BAKE = """
The bake is compared over the first order with the ensemble's reference at the bake's own kernel. The table gives the
angle at which Y is greatest. It also gives the rms difference of the dominant wavelength over all views with at least a
tenth of the greatest Y.
"""

MAPS = """
The pixel (x, y) = (sin t cos p, sin t sin p) shows the view at t from the normal and at the azimuth p. The light is
along the normal unless a caption says otherwise. Wavelengths are 5 nm apart, and Fresnel and obliquity are included.
The exposure makes the 99.5th percentile of Y white. The thesis exposes by eye, so hues and places can be compared, but
not brightness.
"""

MAPS_BLAZE = """
FLSS, Chebyshev and the thesis's FLSS show the same orders in the same places. The strongest orders lie left of the
middle, where a facet that rises towards +T sends its light. The orders of the bake and of the reference are wider,
because their ensemble has 30 coherence areas and not one. NMM as printed has the thesis's purple ends (see its inset),
because its sum lacks the Jacobian of the wavelengths' spacing. The thesis paints the specular disc white; we sum it.
Both kinds of PQ spread across the strongest order, because no window apodises the patch. They do so in the thesis too,
but its exposure hides most of the spread. Stam's form is exact for a line grating. The rainbow of GPU Gems fills the
hemisphere because it ignores v. In the thesis's picture the rainbow is on the orders' line only, so something that the
text does not mention must have masked it.
"""

MAPS_ELAPHE = """
The thesis's two wings with blue inside and red outside, the faint bands above and below them and the speckle about the
middle are all there, in the same places. The thesis's vertical streak is missing: raw edges draw it, and our edges are
apodised. NMM does not work on a skin. It reads a window where one grating equation holds, which leaves a black square
about the middle, with or without the Jacobian. The bake and the reference agree with each other. They show the wings
without the speckle, which only this one patch has. PQ with the right product looks like FLSS, as in the thesis. The
thesis's inset shows it combed into lines that 256 pixels do not resolve. PQ as printed is magenta and has a dark cross
on the axes. Stam's form knows one profile and one direction, which gives two wings on a line.
"""

MAPS_XENOPELTIS = """
We have no picture of the thesis for this surface. The strong orders lie along B, as the fingers do.
"""

COHERENCE = """
The names in the thesis's repository are read as 4 sigma_s in micrometres. With that reading, blobs and widths agree at
every length; if the names were sigma_s, ours would be four times too narrow. At 3.25 um, little more than one period,
the orders melt together, as in the thesis. The thesis's pictures at short lengths are overexposed until only an outline
is left; ours are exposed at the 97th percentile. They are made with 5 x 5 texels and patches of few periods, because a
shader's 3 x 3 texels on the 65 um patch cannot hold so wide a window.
"""

STEPS = """
At 50 nm the wings break up into dots, eight sets of speckle side by side, in the thesis and here. At 10 nm the
difference from 5 nm is slight.
"""

TAYLOR = """
One term is the mirror alone: a dot in the thesis, and here a small star, which is the transform of our apodisation. Two
terms are the first-order perturbation, which has everything in its place. 39 terms agree with the exact phasor. In
between **we do not agree with the thesis**: our series fails at nine and ten terms, as it must. The scan's relief is
408 nm once it is levelled (375 nm raw). Counted from the lowest point, z is then 13.5 at 380 nm where dust stands that
high, and 13.5^10 / 10! = 55000. The thesis finds nine terms enough, with a blue haze at four. Half of the height gives
just that:
"""

HALF = """
So the thesis's pictures look like a phase of half the size. They do not tell where the factor of two is: in a height
scale, or in s taken as 1 / lambda. Heights counted from the middle of the range converge by nine terms, too, but show
no blue haze at four.

The thesis's scan and light are within the range of float32 (loss 5e-3). Beyond some 430 nm of relief, with heights from
the lowest point, they are not, and the series is refused:
"""

INCIDENCE = """
The pattern moves against the light by sin theta_i. It is otherwise the same in (u, v), except that w falls, which
weakens the relief's phase.
"""

SLITS = """
The light has 500 nm, the slits are 30 um wide and 150 um apart, and the screen is at 0.5 m (precompute/study/slits.py).
The orders are 1.67 mm apart under the envelope of one slit, whose first zero removes the fifth order. There are N - 2
side maxima between two orders. The strip below each curve shows white light: white in the middle, then blue to red in
each order. From the second order on the orders overlap.
"""

CREDIT = """
Elaphe guttata was measured by the Laboratory of Artificial and Natural Evolution, Geneva. The scan is from
simplay/Bachelor-Thesis (MIT, Michael Single).
"""
