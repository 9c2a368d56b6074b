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
        lines.append(
            [
                name,
                f"{one.peak_angle_deg:.3f}",
                f"{one.reference_peak_angle_deg:.3f}",
                f"{one.dominant_wavelength_rms_nm:.2f}",
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

What M. Single's thesis (Bern 2014) shows of its methods, computed by this project's. One command makes every picture,
number and table of this page:

    ./dev bench evaluation

The thesis's own pictures are not ours to publish. Below each of ours stands the name that its counterpart has in the
thesis's public repository (simplay/Bachelor-Thesis); where those pictures lie beside a checkout, the command also
writes sheets with both to `docs/thesis_comparison`, which git ignores.

Surfaces: the blaze is `sample:blazed` (2.5 um, 246.23 nm, the thesis's numbers). {elaphe}
The thesis's scan of Xenopeltis unicolor is not public: `sample:xenopeltis` stands in, built to its published period and
relief.

**What agrees**: the blaze's period and angles by FLSS, NMM and PQ; the shape, the place and the order of the colours of
the blaze and of Elaphe by FLSS; the effect of coherence and of the wavelength step; PQ's spread across the orders.
**What does not**: the exact Elaphe period, which belongs to one patch's speckle; how many Taylor terms Elaphe needs,
where the thesis's pictures look like half the relief; the vertical streak through its Elaphe maps, which raw edges
draw; PQ on Elaphe; brightness, which the thesis leaves uncalibrated. Each has its reason below, or it is said that we
do not know it.
"""

SCAN = "Elaphe is the thesis's own scan, 65 um wide, 375 nm from black to white."
STAND_IN = "The scan of Elaphe was not there when this page was made: `sample:elaphe` stands in."

HOW_PERIODS = """
Light at 75 degrees from -T, 81 wavelengths from 380 to 780 nm, first order, 65 um of coherence in both models. The peak
of a wavelength is the vertex of a parabola through the logarithms of the highest sample and its neighbours, on angles
0.02 degrees apart that hold no expected angle; its period is lambda / |u|. Mean and population variance are over the
wavelengths. Angles are compared with the grating equation with the method's own mean period. R and O are left out.
Judge FLSS, Chebyshev, NMM and PQ by `reference-patch` (one window on one patch), Stam's form and the bake by
`reference` (the ensemble: the mean over all places of the window). In the plots red are the peaks, dashed the grating
equation; brightness is the square root of the response, each panel by itself.
"""

BLAZE = """
The references, FLSS, Chebyshev and NMM agree to 0.0001 nm in the patch model, and both models to 0.001. All stand 0.4
nm under 2500, and 0.03 under it with light from the other side: the order's efficiency depends on w, w on the viewing
angle, and so the order is a little brighter on one of its sides. That is the surface's physics and no error: with w
held fixed the same peaks give 2500.000. NMM's response is FLSS's where the grating equation holds to half a step, so
its agreement is all but built in, here as in the thesis.

The thesis's 2499.997 / 0.377 is met in the mean (from +T to 0.02 nm) and undercut in variance. A peak that is the top
sample of an angle grid, without a fit between samples, has a variance of {grid:.3f} square nanometres at 0.017
degrees a step: the thesis's 0.377 is of that size, the grid's and not the optics'.

PQ repeats one cell under a sharp aperture instead of a soft window, so that the cell's own transform pulls each order:
2502.5 nm if its sinc interpolation reads 21 x 21 texels, 2501.8 with a shader's 3 x 3. The thesis's 2502.428 / 0.390 is
near the former. As printed, with the wrong product and a sum that runs one copy too far, it scatters. The author's log
in the repository has another pair under the same name, 2491.86 / 248.04.
"""

ELAPHE = """
The thesis's 1144.26 nm is one number of many that this scan can give. Its first order is no line but a comb of speckle,
as its own plot shows (`flss_elaphe`): stripes at many periods, of which the brightest wins, at all wavelengths alike,
so that the *variance* stays small however arbitrary the *mean* is. Which stripe wins depends on where the window lies:

- With our apodisation and the window in the middle, light from -T: about 1127 nm. From +T, the other first order: 1182
nm. - Cut as the thesis does (raw edges, window on the patch's corner), light from +T: within 2 nm of 1144.26. That is
the
  nearest set-up we found; we cannot know its light's side for certain.
- NMM told 1144.26 nm finds something near 1139 nm: it can only see wavelengths within half a step of what it is told.
- FLSS differs from its reference by a fifth of a nanometre, which is the price of 3 x 3 texels: with more texels it
  meets it (tests/precompute/methods/test_methods_patch.py). Chebyshev and Taylor images agree to a millionth.
- Stam's form knows the period that it is given (found in the relief by `info`) and nothing of the speckle.
- Over 30 areas the order from +T still has three summits, near 1029, 1146 and 1179 nm, within a seventh of the same
  height at 580 nm. Under 440 nm the first is the brightest, over it the last: hence the variance in the last row.
- PQ as printed in the thesis gave 1052 / 49.7 and jumps between stripes; our printed PQ does not jump on this side, and
  lands on another stripe than the right product.
"""

ELAPHE_STAND_IN = """
A stand-in: its period is not the scan's, and the thesis's numbers are not for it. What holds for both: the first order
of one patch is a comb of speckle, of which one stripe wins.
"""

PIECES = """
To see how much of the period is chance, the surface was cut into nine pieces, each with a coherence of its own length:
their periods run from {low:.0f} to {high:.0f} nm (mean {mean:.1f}, standard deviation {spread:.1f}). An average over 30
coherence areas (last rows of the table) is what a rendered skin should show; the bake takes it by default.
"""

XENOPELTIS = """
A relief of 819 nm at 380 nm: the Taylor series in float32, which a shader has, loses all digits (its largest term is
some 10^10 times their sum) and is refused; the table's Taylor methods ran in float64. Chebyshev does not need it. The
thesis evaluated its scan with 37 terms: at the full phase its phasor would be off by 3 (rms) at 380 nm; at half of it,
which its Elaphe maps suggest (below), it has converged. Its repository's log says 1594.06 / 1.87 for this surface, the
printed table 1552.27 / 0.45. Our surface was built to 1552 nm with a random ground, and gives that to the few
nanometres of its speckle.
"""

BAKE = """
Compared over the first order with the ensemble's reference at the bake's own kernel: the angle where Y is
greatest and, over all views of at least a tenth of that Y, the dominant wavelength.
"""

MAPS = """
Pixel (x, y) = (sin t cos p, sin t sin p), light along the normal unless said, 5 nm steps, Fresnel and obliquity
included, exposed so that the 99.5th percentile of Y is white. The thesis exposes by eye; hues and places compare,
brightness does not.
"""

MAPS_BLAZE = """
FLSS, Chebyshev and the thesis's FLSS show the same orders in the same places, the strongest left of the middle, where
a facet that rises towards +T sends its light. The bake's and the reference's orders are wider: an ensemble of 30 areas,
not of one. NMM as printed has the thesis's purple ends (see its inset), as its sum lacks the Jacobian of the
wavelengths' spacing; the thesis paints the specular disc white, we sum it. Both kinds of PQ spread across the strongest
order, as in the thesis, whose exposure hides most of it: no window apodisation_axes the patch. Stam's form is exact for
a line grating. The rainbow of GPU Gems fills the hemisphere because it ignores v; the thesis's picture has it on the
orders' line only, so that something that its text does not tell must have masked it.
"""

MAPS_ELAPHE = """
The thesis's two wings with blue inside and red outside, the faint bands above and below them and the speckle about the
middle are all there, in the same places. The thesis's vertical streak is not: raw edges draw it, and ours are apodised.
NMM does not work on a skin: a window where one grating equation holds leaves a black square about the middle, with or
without the Jacobian. The bake and the reference agree with each other, and show the wings without the speckle, which
only this one patch has. PQ with the right product looks like FLSS, as in the thesis, whose inset shows it combed into
lines that 256 pixels do not resolve; as printed it is magenta and has a dark cross on the axes. Stam's form knows one
profile and one direction: two wings on a line.
"""

MAPS_XENOPELTIS = """
No picture of the thesis is at hand for this surface. The strong orders lie along B, as its fingers do.
"""

COHERENCE = """
The names in the thesis's repository are 4 sigma_s in micrometres: with that reading, blobs and widths agree at every
length; with sigma_s they would be four times too narrow. At 3.25 um, little more than one period, orders melt
together, as there. The thesis's pictures are overexposed at short lengths, until only an outline is left; these are
exposed at the 97th percentile. Made with 5 x 5 texels and patches of few periods: a shader's 3 x 3 texels on the 65 um
patch cannot hold so wide a window.
"""

STEPS = """
At 50 nm the wings break up into dots, eight sets of speckle side by side, in both; at 10 nm the difference is slight.
"""

TAYLOR = """
One term is the mirror alone: a dot in the thesis, here a small star, which is the transform of our apodisation. Two are
the first-order perturbation: everything in its place. 39 agree with the exact phasor. In between **we do not agree with
the thesis**: ours fails at nine and ten terms, as it must. The scan's relief is 408 nm once it is levelled (375 raw),
so that z is 13.5 at 380 nm counted from the lowest point; dust stands that high, and 13.5^10 / 10! = 55000. The thesis
finds nine terms enough, with a blue haze at four. Half the height gives just that:
"""

HALF = """
So the thesis's pictures look like a phase of half the size. Which factor of two that is (a height scale, or s taken as
1 / lambda) they do not tell. Heights counted from the middle of the range converge by nine terms, too, but show no blue
haze at four.

The thesis's scan and light are within what float32 holds (loss 5e-3). Past some 430 nm of relief, un-centred, they are
not, and a run is refused:
"""

INCIDENCE = """
The pattern moves against the light by sin theta_i and is otherwise the same in (u, v), but for w, which weakens the
relief's phase as it falls.
"""

SLITS = """
500 nm, slits 30 um wide and 150 um apart, screen at 0.5 m (precompute/study/slits.py): orders 1.67 mm apart under one
slit's envelope, whose first zero takes the fifth order away; N - 2 side maxima between orders. Below each curve the
same with white light: white in the middle, then blue to red in each order, overlapping from the second on.
"""

CREDIT = """
Elaphe guttata measured by the Laboratory of Artificial and Natural Evolution, Geneva; from simplay/Bachelor-Thesis
(MIT, Michael Single).
"""
