# SPDX-License-Identifier: GPL-3.0-or-later
"""The prose of docs/evaluation.md, piece by piece; laboratory.benchmarks.evaluation_page lays it out."""

INTRODUCTION = """
# The thesis's evaluation, done again

M. Single's thesis (Bern 2014) evaluates its methods. This page repeats the evaluation with this project's methods. One
command makes every picture, number and table of the page:

    ./dev bench evaluation

The thesis's own pictures are not ours to publish. Below each of our pictures stands the name of its counterpart in the
thesis's public repository (simplay/Bachelor-Thesis). Where those pictures lie beside a checkout, the command also
writes sheets that show both to `docs/thesis_comparison`, which git ignores.

The blaze is `sample:blazed` (2.5 um, 246.23 nm, the thesis's numbers).
{skins}

**The thesis's cut.** One set-up, which the thesis does not describe, gives its maps of both skins speckle by speckle,
and its period of Elaphe: the heights as they were measured, without levelling; counted from their mean; raw edges; and
the coherence window centred on the patch's corner, because the transform starts there. The rows and the maps that say
"cut as the thesis" are made so. All others are ours: the plane is subtracted, the edges are apodised, and the window is
in the middle of the scan.

**These results agree**: the blaze's period and angles by FLSS, NMM and PQ; the period of Elaphe by FLSS and NMM, and
about that of PQ as printed, in the thesis's cut; the maps of both skins by FLSS and PQ, of Xenopeltis at all three
angles of the light; the numbers of Taylor terms at which the maps of both skins fail and converge; the effect of
coherence and of the wavelength step.

**These results do not agree**: the period of Xenopeltis, where the stripes in the thesis's plot are not those of this
scan; the variance of PQ as printed on Elaphe; brightness, which the thesis leaves uncalibrated. In our own cut the
period of Elaphe is another one, because it belongs to one patch's speckle, and the vertical streak through the thesis's
maps is missing, because raw edges draw it. The sections below give a reason for each difference, or say that we do not
know it.
"""

SCANS = """
Elaphe and Xenopeltis are the thesis's own scans, 65 um wide, 375 and 818.69 nm from black to white. The rows of fingers
of Xenopeltis are 1.5 um apart along B, so its strong orders lie above and below the middle of a map. The fingers of a
row are 0.53 to 0.58 um apart, which gives the weak orders at the left and the right edge.
"""
STAND_INS = """
The scans were missing when this page was made, and `sample:elaphe` and `sample:xenopeltis` take their places. What the
page says about the skins of the thesis was seen on the scans.
"""

TABLE_5_1 = """
This is the thesis's table of periods (5.1) with ours beside it. A skin has several of our rows, because its period
depends on how the patch is cut. The thesis gives no NMM and no PQ for Xenopeltis.
"""

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
The scan's first order is not a line but a comb of speckle, as the thesis's own plot shows (`flss_elaphe`). It has
stripes at many periods. The same stripe is the brightest at all wavelengths, so that the *variance* is small, however
arbitrary the *mean* is. The cut, the place of the window and the side of the light decide which stripe is the
brightest:

- With our cut and light from -T, the period is about 1127 nm. With light from +T, at the other first order, it is
  1182 nm.
- In the thesis's cut with light from +T, FLSS and NMM give 1144.09 nm, 0.17 nm from the thesis's 1144.26. The side of
  the light was chosen by this agreement: from -T the same cut gives 1065 nm.
- PQ as printed jumps between stripes in the thesis's cut, as it does in the thesis. Its mean is within 3 nm of the
  thesis's; its variance says at how many wavelengths it jumps, and does not agree. PQ with the right product jumps
  there, too.
- NMM that is told 1144.26 nm in our cut finds about 1139 nm: it only sees wavelengths within half a step of those that
  it is told.
- FLSS differs from its reference by a fifth of a nanometre. That is the price of 3 x 3 texels: with more texels it
  meets the reference (tests/precompute/methods/test_methods_patch.py). Chebyshev and Taylor images agree to a
  millionth.
- Stam's form knows the period that it is given (found in the relief by `info`) and nothing of the speckle.
- With 30 coherence areas the order from +T still has three summits, near 1029, 1146 and 1179 nm. At 580 nm their
  heights are within a seventh of each other. Under 440 nm the first summit is the brightest, above it the last: hence
  the variance in the last row.
"""

SKIN_STAND_IN = """
This surface takes the place of the scan. Its period is not the scan's, and the thesis's numbers do not apply to it. One
thing holds for both: the first order of one patch is a comb of speckle, and one stripe of it is the brightest.
"""

PIECES = """
How much of the period is chance? The surface was cut into nine pieces, each as long as its coherence length. Their
periods run from {low:.0f} to {high:.0f} nm (mean {mean:.1f}, standard deviation {spread:.1f}). A rendered skin should
show an average over 30 coherence areas (the last rows of the table), and the bake takes that average by default.
"""

XENOPELTIS = """
The thesis's table says 1552.27 / 0.45. The log in its repository says 1594.06 / 1.87, with the remark to run it twice
so that lower values are filtered out, and its plot (`flss_xeno`) is of that run: its curve passes 1594 nm, and beyond
580 nm its peaks jump to another stripe. Around that period the plot shows stripes near 1280, 1445, 1505, 1595, 1700,
1790 and 1960 nm at 400 nm. Of these our own cut has those at 1445 and 1505 nm, and the thesis's cut none; neither is
bright beyond 1800 nm, from either side of the light. The plot's best correlation with ours is 0.36. It reaches 0.6 only
if the scan's size is changed by 5 %. The maps below agree with the scan speckle by speckle, so it is the one that the
thesis drew. Perhaps the evaluation was run on another file, the scan before it was turned upright (the name there is
`XenoRotated`); we do not know.

So **1552.27 nm is not reproduced**. It lies among what this skin gives: our cut gives 1559 nm with light from +B and
1547 nm from -B; the thesis's cut gives 1515 nm from +B and jumps between stripes from -B. The mean over all places of
the window (`reference`) is 1506 nm, which is also the distance of the rows of fingers that `info` tells.

The relief is 805 nm deep once it is levelled. At 380 nm and counted from the lowest point, the Taylor series in
float32, which a shader has, loses all digits: its largest term is some 10^10 times the sum. It is therefore refused.
The Taylor methods of the table ran in float64 with heights that count from the middle. Chebyshev does not need that.
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
middle are all there, in the same places. Cut as in the thesis, the map has its vertical streak, too, which raw edges
draw; our own cut has no streak, because its edges are apodised. NMM does not work on a skin. It reads a window where
one grating equation holds, which leaves a black square about the middle, with or without the Jacobian. The bake and
the reference agree with each other. They show the wings without the speckle, which only this one patch has. PQ with
the right product looks like FLSS, as in the thesis. The thesis's inset shows it combed into lines that 256 pixels do
not resolve. PQ as printed is magenta and has a dark cross on the axes. Stam's form knows one profile and one
direction, which gives two wings on a line.
"""

MAPS_XENOPELTIS = """
The thesis's map has two fans above and below the middle, blue inside and red outside, the lower one brighter; fainter
second orders beyond them; and blue orders of the fingers at the left and the right edge. All of them are in ours, in
the same places and with the same stripes. Ours is exposed more brightly, so the edge's orders and the second orders
stand out more. The lower fan's brightness comes from the fingers' slope, which a first-order perturbation cannot show
(n = 0 to 1 below, where the fans are alike). The reference and the bake agree with each other, and show the fans
without the speckle.
"""

AGREEMENT = """
The table gives Spearman's rank correlation of the 8-bit pictures, pixel by pixel at 256 pixels, without smoothing, for
red, green and blue, on the left half of the disc between 0.1 and 0.95 of its radius. Ranks do not depend on exposure or
gamma. The last column is a control: the same with our map turned by half a turn, which keeps the orders' places but not
the speckle. Two terms of Taylor's series draw a map that is its own half turn, so there the two columns are alike. At n
= 23 and 25 the magenta disc is clipped, and ranks tell little.
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

TAYLOR_ELAPHE = """
One term is the mirror alone, a dot. Two terms are the first-order perturbation, which has everything in its place. At n
= 4 the map is under a blue haze, at n = 9 it has converged, and 39 terms change nothing: all as in the thesis, except
that its haze is whiter.

Heights that count from the mean decide that. The highest dust is 178 nm above the mean and the deepest scratch 197 nm
under it, so z is 6.5 at 380 nm. Counted from the lowest point, as one could read Algorithm 1, z is 12.4, and the series
fails at n = 9 (12.4^10 / 10! = 24000).
"""

TAYLOR_XENOPELTIS = """
Here the thesis shows how the series fails, and ours fails in the same way: a tilted ellipse of haze at n = 3, a magenta
disc at n = 23 that is smaller at n = 25, and the whole map at n = 39. The ellipse is the transform of one grain of dust
at the scan's edge. It stands 539 nm above the mean, so z is 17.8 there, and 17.8^24 / 24! = 1.7 million, which a grain
of 0.03 % of the area still brings above the orders. The skin itself is within some 270 nm of the mean. Our disc at
n = 25 is larger than the thesis's, by its exposure at least.

Neither half of the phase nor another origin does this. At half of the phase the two fans are almost alike, where the
thesis's lower fan is the brighter one. Counted from the lowest point, 39 terms do not converge. Counted from the middle
of the range, n = 23 has converged. In our cut there is no haze, because the apodisation takes the grain away.
"""

FLOAT32 = """
The thesis's heights, counted from the mean, and its light are within the range of float32 for Elaphe (loss 6e-6) and
not for Xenopeltis (loss 0.3 on the grain). Beyond some 430 nm of relief, with heights from the lowest point, the series
is refused:
"""

INCIDENCE = """
The pattern moves against the light by sin theta_i. It is otherwise the same in (u, v), except that w falls, which
weakens the relief's phase.
"""

INCIDENCE_XENOPELTIS = """
Xenopeltis by FLSS (over Chebyshev images) and by PQ with the right product, both cut as in the thesis, which shows the
same six maps. At 10 and 20 degrees the fans move to the right with the mirror direction, the left blue order turns
green and red, and the right one sets. PQ has the same orders in the same places, combed into fine lines: one copy of
the patch, without a window.
"""

SLITS = """
The light has 500 nm, the slits are 30 um wide and 150 um apart, and the screen is at 0.5 m (laboratory/study/slits.py).
The orders are 1.67 mm apart under the envelope of one slit, whose first zero removes the fifth order. There are N - 2
side maxima between two orders. The strip below each curve shows white light: white in the middle, then blue to red in
each order. From the second order on the orders overlap.
"""

CREDIT = """
Elaphe guttata and Xenopeltis unicolor were measured by the Laboratory of Artificial and Natural Evolution, Geneva. The
scans are from simplay/Bachelor-Thesis (MIT, Michael Single).
"""
