# SPDX-License-Identifier: GPL-3.0-or-later
"""The page and the plot of the benchmark of the picture."""

import argparse
from pathlib import Path

from precompute.base.files import write_whole

from ..speed.run import machine, pareto
from ..speed.tables import markdown, number
from ..study import plots

PAGE, PLOT = "speed_in_the_picture.md", "speed_in_the_picture.png"
TITLES = {"hero": "A snake from afar", "macro": "Scales close by", "cd": "A disc"}
_HEAD = """# Speed against error in the picture

How long does each way to shade a diffraction grating render, and how far is the picture from the exact one? This
command renders each scene by each method and writes this page:

    ./dev bench picture --width {width} --reference {reference} --most {most:g} --output docs

{machine}, Blender {blender}, {width} pixels wide. The scenes are the sample scenes `hero`, `macro` and `cd` with their
suns; lamps alone light the gratings. The reference is the mean of two renders by Cycles of {reference} samples
together, in which the OSL shader evaluates Direct's formula exactly, with a bake of dE 0.25. The errors of one of its
halves against the other are told for each scene: smaller errors cannot be measured here.

- **Seconds** are the processor's of all samples of a picture, without compiling and the scene's preparation. Read the
  ratios.
- **dE00** is CIEDE2000 over the lit pixels, at the exposure that puts the 99th percentile of Y at 1.
- **FLIP** is the mean of NVIDIA's FLIP at that exposure, for a display at its default distance.
- **Light** is the picture's mean over the reference's.
- The Pareto front of seconds and FLIP is bold: no other picture of that engine is both faster and nearer.
- *needs* is a bake of what the scene needs; *footprint* has the footprint of a pixel count ([Direct](direct.md)).
- NMM, PQ and FLSS are the thesis's methods in OSL with 81 wavelengths. They see one patch of the surface, so they show
  its speckle, which the mean over all places has not; that counts as error here. They end where a picture takes a
  quarter of {most:g} seconds.
- *Three lobes* and *GPU Gems* are [fakes](lights.md), brought to the reference's light.
- EEVEE's pictures are held against the same reference by Cycles, so what the engines do differently with shadows, the
  sky and the skin counts as error too.

![Error against seconds, for each scene and engine](images/{plot})
"""


def write_page(tables: list[dict], arguments: argparse.Namespace) -> None:
    """Write the page and its plot into a folder."""
    import bpy

    images = arguments.output / "images"
    images.mkdir(parents=True, exist_ok=True)
    plot(tables, images / PLOT)
    on = machine()
    text = _HEAD.format(
        machine=f"{on.processor}, {on.cores} cores, no GPU",
        blender=bpy.app.version_string,
        width=arguments.width,
        reference=arguments.reference,
        most=arguments.most,
        plot=PLOT,
    )
    text += "\n" + "\n".join(section(table) for table in tables)
    write_whole(arguments.output / PAGE, lambda partial: partial.write_text(text, encoding="utf-8"))


def section(table: dict) -> str:
    """A scene's table in one engine."""
    engine = {"cycles": "Cycles", "eevee": "EEVEE"}[table["engine"]]
    own = table["reference"]
    front = [table["rows"][k] for k in pareto([(row["seconds"], row["flip"]) for row in table["rows"]])]
    lines = [
        [f"**{row['method']}**" if row in front else row["method"], str(row["samples"]), number(row["seconds"]),
         number(row["mean"], 2), number(row["p95"], 2), f"{row['flip']:.4f}", f"{row['light']:.3f}"]
        for row in table["rows"]
    ]  # fmt: skip
    head = ("method", "samples", "seconds", "dE00 mean", "p95", "FLIP", "light")
    return (
        f"## {TITLES[table['scene']]}, {engine}\n\n"
        f"One half of the reference against the other: dE00 {number(own['mean'], 2)} (mean), FLIP {own['flip']:.4f}; "
        f"it took {number(own['seconds'])} s.\n\n{markdown(head, lines)}\n"
    )


def plot(tables: list[dict], path: Path) -> None:
    """FLIP over seconds, a panel for each scene and engine, a line for each method."""
    pyplot = plots.pyplot()
    figure, panels = pyplot.subplots(
        1, len(tables), figsize=(max(4.6 * len(tables), 8), 6), sharey=True, squeeze=False, layout="constrained"
    )
    names = list(dict.fromkeys(row["method"] for table in tables for row in table["rows"]))
    for panel, table in zip(panels[0], tables, strict=True):
        for name in names:
            points = [(row["seconds"], row["flip"]) for row in table["rows"] if row["method"] == name]
            if points:
                style = "--" if "footprint" in name else "-"
                panel.plot(*zip(*points, strict=True), style, marker="o", markersize=4, label=name, color=colour(name))
        panel.set(xscale="log", yscale="log", xlabel="seconds of a picture")
        panel.set_title(f"{TITLES[table['scene']]}, {table['engine']}")
        panel.grid(alpha=0.25)
    panels[0, 0].set_ylabel("FLIP, mean")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, loc="outside lower center", ncols=4)
    write_whole(path, lambda partial: figure.savefig(partial, dpi=80))
    pyplot.close(figure)


def colour(name: str) -> str:
    """A method's colour; needs and footprint have that of the bake."""
    kinds = (
        "three lobes",
        "GPU Gems",
        "Direct dE 3",
        "Direct dE 1",
        "Direct dE 0.3",
        "OSL Direct",
        "OSL NMM",
        "OSL PQ",
    )
    known = (k for k, kind in enumerate(kinds) if name.startswith(kind))
    return f"C{next(known, len(kinds))}"
