# SPDX-License-Identifier: GPL-3.0-or-later
"""The text of docs/hard_cases.md around its table."""

HEAD = """# Hard cases

This page tells which surfaces are hard for a bake and how the bake deals with them. `./dev bench hard_cases` makes it.

Each surface is baked for a dE00 of 1, as the verb `bake` bakes it. What the bake's file would hold is compared with the
reference (exact transforms in float64, without a table). dE00 is the 99th percentile over some hundred pairs of
directions, at the worst of four exposures. dY is the sum of the absolute errors of luminance over the sum of the
luminances. A case that is "against none" is compared with the surface without the fault. The scans are 10 um wide and
hold bumps 200 nm high, unless the table says otherwise. The same cases are tests:
`tests/precompute/bake/test_hard_cases.py`.
"""

SCENES = """## In a scene

Cycles renders `sample:elaphe` under one sun on 16 x 16 pixels with 64 samples
(`laboratory/benchmarks/hard_scenes.py`). "Apart" is the greatest difference of the pictures with and without the
footprint of a pixel, over the greatest value.
"""

TAIL = """## Why the cases end so

- **Deep reliefs.** The terms of a deep relief are large because it scatters most at w = 0; where w is large, they all
  but cancel. In half floats a relief of 1 um was off by a dE00 of 2, and a relief of 2 um by 19. The bake measures that
  on a dozen patches of the surface, and writes 32-bit floats where half floats are not enough. Blender holds the
  picture in 32 bits in any case; only the file grows.
- **Shallow reliefs.** A relief of 0.05 nm scatters 1e-8 of white. The tiles have a scale of their own, so that half
  floats can hold them; the zero order is kept unscaled beside them. With one scale for both, dark places were off by a
  dE00 of 5.
- **Theta of 89.9 degrees.** The table is as right here as elsewhere. Stam's form, however, reflects more than it
  receives. The energy-conserving form, which is the materials' default, stays under 1.
- **One row or column** is a profile that does not change across its line; the other side of the pixel has no effect.
- **Tiny scans.** A coherence window cannot be shorter than a wavelength. A scan that does not hold 30 of the smallest
  windows is refused. A coherence length that is asked for and exceeds the scan is refused too: it would show one
  speckle of this scan and not the skin. A surface that wraps exactly has no such limit.
- **Dust** is part of the surface, and the bake renders it correctly. But grains of 1 um raise the number of terms of a
  relief of 200 nm from 3 or 4 to 15, and scatter white light of their own. Remove grains that are not the animal's in
  the scan's own software.
- **Holes** are filled smoothly; the error in the table is the change that the filling makes.
- **Tilt** is removed with the plane, exactly but for rounding (1e-15 m).
- **8-bit steps** of height d scatter (2 pi w / lambda)^2 d^2 / 12 of the light, spread evenly over the hemisphere. That
  is 3e-5 at 0.8 nm and 3e-3 at 7.8 nm (w = 2, 550 nm). Let the picture's black and white span the relief.
- **Period under the shortest wavelength.** Under light from above the surface is black but for the mirror image. Under
  grazing light the one order that is left returns towards the lamp.
- **Period longer than the patch.** The patch holds a slope and a bend. Levelling removes the slope; the rest agrees
  with the reference. No scan can tell of a period that it does not hold.
- **Narrow orders.** The wavelength step follows the kernel's width, so that neighbouring orders add up to white without
  gaps.
- **8192 x 8192 pixels** are not in this table: their time and memory are measured apart.
"""
