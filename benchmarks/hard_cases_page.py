# SPDX-License-Identifier: GPL-3.0-or-later
"""The text of docs/hard_cases.md around its table."""

HEAD = """# Hard cases

What is hard for a bake, and what becomes of it: `./dev bench hard_cases` makes this page. Each surface is baked for a
dE00 of 1 as `bake` does it, and what its file would hold is measured against the reference itself (exact transforms in
float64, no table): dE00 is the 99th percentile over some hundred pairs of directions at the worst of four exposures, dY
the sum of the luminances' errors over the sum of the luminances. "Against none" is against the surface without the
fault. The same cases are tests: `tests/precompute/bake/test_hard_cases.py`. Scans are of 10 um, of bumps 200 nm high.
"""

TAIL = """## What is behind them

- **Deep reliefs.** The terms are large for the sake of w = 0, where a deep relief scatters most, and all but cancel
  where w is large: in half floats a relief of 1 um was off by a dE00 of 2, one of 2 um by 19. The bake measures that
  on a dozen patches of the surface and writes 32-bit floats where halves do not do. Blender holds the picture in 32
  bits in any case; only the file grows.
- **Shallow reliefs.** What 0.05 nm scatter is 1e-8 of white. Tiles have a scale of their own, so that halves hold them;
  the zero order is kept unscaled beside them. With one scale for both, dark places had been off by a dE00 of 5.
- **Theta of 89.9 degrees.** The table is right as ever; it is Stam's form that reflects more than it receives. The
  energy-conserving form, the materials' default, stays under 1.
- **One row or column** is a profile that does not change across: the pixel's other side counts for nothing.
- **Tiny scans.** A coherence window under a wavelength is none; a scan in which 30 of the smallest do not fit is
  refused. So is a coherence that is asked for and longer than the scan: it would show one speckle of this scan, not
  the skin. What wraps exactly has no such limit.
- **Dust** is part of the surface, and the bake is right about it; but grains of 1 um take a relief of 200 nm from
  3 or 4 terms to 15, and scatter white light of their own. Take them off in the scan's own software if they are not
  the animal's.
- **Holes** are filled smoothly; the figure is what the filling itself changes.
- **Tilt** goes with the plane, exactly but for rounding (1e-15 m).
- **8-bit steps** of d scatter (2 pi w / lambda)^2 d^2 / 12 of the light, spread evenly over the hemisphere: 3e-5 at 0.8
  nm, 3e-3 at 7.8 nm (w = 2, 550 nm). Let the picture's black and white span the relief.
- **Period under the shortest wavelength.** Black but for the mirror image under light from above; under grazing light
  the order that is left comes back, towards the lamp.
- **Period longer than the patch.** A slope and a bend: levelling takes the slope, and the rest is right against the
  reference. No scan tells of a period that it does not hold.
- **Narrow orders.** The wavelengths follow the kernel, so that orders side by side make white without gaps.
- **8192 x 8192** is not in this table: its time and memory are measured apart.
"""
