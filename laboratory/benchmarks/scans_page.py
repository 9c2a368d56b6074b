# SPDX-License-Identifier: GPL-3.0-or-later
"""The text of docs/scans.md."""

from precompute.surface.steps.pipeline import KINDS

TITLES = {"elaphe": "Elaphe guttata", "xenopeltis": "Xenopeltis unicolor"}

HEAD = """# Scans: their quality, levelling and repair

`./dev bench scans` makes this page, its figures and its pictures. A microscope's scan is tilted, and carries dust,
scratches and the marks of its tip. `info` tells how good a scan is, and `--level` repairs it:

    ./dev grating info scan.nid                              what limits the scan, each with a light: good, usable, poor
    ./dev grating info scan.nid --level plane,scars,dust     the same after the steps
    ./dev grating bake scan.nid --level plane,scars,dust -o bakes

Steps are done in the order given. The bake's header records them (`bake --request` repeats them, `check` holds the bake
against the levelled heights), and they are part of the cache's key. Without `--level` a plane is taken out and holes
are filled, and nothing else. `none` takes nothing out; holes are filled in any case.

In Blender's panel the same steps are the list Levelling. A button shows them as the text that `--level` takes, to copy
or to paste. Each change is made a preview of, once the hand rests: the heights as scanned and levelled, in red what is
made holes, the range, the rms and the main period of both, and what the steps have to tell. A scan of more than 768
pixels a side is thinned for it, which the panel says; the bake takes all pixels.

| step | what it does |
|---|---|
"""

LINES = """
Several scans of one skin, or tiles of one large area, make one bake: the mean of their spectra, each levelled by the
same steps. Name several files to `bake`, or choose One Grating in the import dialog; the panel lists them. Tiles need
not fit together, nor be of one size. No coherence length is longer than a tile allows.

A step that takes out what the grating is made of says so: `lines`, `poly`, `scars`, `outliers` and `dust` compare the
waves that `info` lists before and after. They warn if the strongest wave loses 5 % of its light, and if a fainter one
loses as much light or half of its own. Holes take their share of the area from every wave, and this share is no reason
for a warning. Line alignment is never done unless it is asked for: where the grating's lines run along the scan's rows,
it erases them. On the real grid, turned so, a plane keeps the rms within 1 %, and alignment warns that it weakens the
peak by 100 % (`tests/precompute/surface/steps/test_lines.py`).

`info` tries each step against dirt before it advises the step, on a part or a thinned copy of the scan. It advises no
step that takes light from a wave on its list. Ridges and pits of a grating can look like scars or dust; `info` then
says which step to leave out. Dust counts by its area and by its height, since a bake grows with the height of the whole
scan: a scan is usable where dust stands off the relief by more than the relief's own height, and poor from ten times
that on.

Three kinds of waves are no gratings, and `info` says so. A *waviness* is too coarse to show colours, and some waves are
finer than light. *Line noise* comes from the microscope: it shifts each row of the scan by a random amount, and the
strongest of the many waves in such shifts looks like a grating with its lines along the rows. `info` leaves it out and
names it. If the surface does have lines along the rows, turn the sample by 90 degrees and scan it again.

Many files hold each line twice, as scanned forward (trace) and backward (retrace). `info` and the import then take a
wave for a grating only if both directions show it: within the resolution of the scan, and with at least half of its
strength. They name any other wave as line noise, and take the next wave that both directions show. In simulated scans
with a slow drift and no grating, one direction alone shows a grating in 18 of 100, and both in 3; these three waves
repeat fewer than four times (`tests/precompute/surface/test_other_way.py`). The preview of the levelling, `calibrate`
and `periods` look at one direction alone.

Pits of random lengths in tracks can make half of the tracks' distance stand out more than the distance itself. `info`,
`calibrate` and `periods` then take the tracks' distance.

## Two real skins, with and without dust and scar removal

Both scans are 65 x 65 um, of 1332 x 1332 pixels of 8 bits. They are baked for a dE00 of {delta_e:g} after a plane
alone, and after repairs. dE00 is between the two bakes, on the same pairs of directions; a bake's own error, against
its exact spectrum, stands beside it. "Terms" are the tiles of the bake: fewer take less memory, and less work for
each pixel.

| skin | steps | removed | relief | terms | MiB in Blender | dE00 mean | dE00 p99 | light that moves | own p99 |
|---|---|---|---|---|---|---|---|---|---|
"""


def row_of(row: dict) -> str:
    """A line of figures, its cells parted as in the table."""
    same = row["p99"] < 0.005  # the plain bake beside itself, but for rounding
    return " | ".join((
        f"`{row['steps']}`",
        f"{row['removed']:.2%}",
        f"{row['height_range_m'] * 1e9:.0f} nm, rms {row['rms_m'] * 1e9:.1f}",
        f"{row['terms']}",
        f"{row['blender_bytes'] / 2**20:.0f}",
        "-" if same else f"{row['mean']:.2f}",
        "-" if same else f"{row['p99']:.2f}",
        "-" if same else f"{row['relative_dy']:.1%}",
        f"{row['own_p99']:.2f}",
    ))  # fmt: skip


def page(skins: list[dict], delta_e: float) -> str:
    """The whole page."""
    steps = "".join(f"| `{kind.form.replace('|', ' or ')}` | {kind.help} |\n" for kind in KINDS.values())
    rows = "".join(f"| {TITLES[skin['name']]} | {row_of(row)} |\n" for skin in skins for row in skin["rows"])
    return HEAD + steps + LINES.format(delta_e=delta_e) + rows + "".join(map(_section, skins)) + TAIL


def _section(skin: dict) -> str:
    plain, *repaired = skin["rows"]
    told = "\n".join(f"    {line}" for line in dict.fromkeys(line for row in repaired for line in row["told"]))
    shown = "heights as scanned, what is removed, heights as filled, the maps of both bakes"
    quality = "\n".join(f"    {line}" for line in skin["quality"])
    return "\n".join((
        f"\n### {TITLES[skin['name']]}\n",
        f"![From left to right: {shown}](images/scans/{skin['name']}.png)\n",
        "What `info` says of it, and what the steps told:\n",
        f"{quality}\n\n{told}\n",
        f"{_saved(plain, repaired)}\n",
    ))  # fmt: skip


def _saved(plain: dict, repaired: list[dict]) -> str:
    """A sentence on the terms that each repair saves."""
    parts = (
        f"`{row['steps']}` saves {saved} of {plain['terms']} terms"
        if (saved := plain["terms"] - row["terms"])
        else f"`{row['steps']}` saves no term of {plain['terms']}"
        for row in repaired
    )
    return "; ".join(parts) + "."


TAIL = """
### What the figures say

No repair saves a term here: the flecks are a few hundred nanometres high, and cover half a percent of a scan at most.
`dust` moves less than a hundredth of the light. Where the 99th percentile of dE00 is large all the same, little light
has changed in directions that have little. What is filled is smooth, without the grating around it. On Xenopeltis
`dust:4` takes the tips of fingers for dust: it warns of the light that the rows lose, and is no repair. Neither scan
has scars; the scratches run aslant, and are too low for `dust`.

Measurements: Laboratory of Artificial and Natural Evolution, Geneva, published with the Bachelor thesis of Michael
Single (MIT licence). From left to right the pictures show the place where the most was removed, 13 um wide: as scanned,
with what is removed in red, as filled for the bake; then the colours of both bakes over the hemisphere of views, under
light from 30 degrees.
"""
