# SPDX-License-Identifier: GPL-3.0-or-later
"""The figures of docs/speed_in_the_picture.md, and its plot. The sentences stand in the page itself."""

import argparse
from pathlib import Path

from precompute.base.files import write_whole

from ..speed.page import number
from ..speed.result import Machine
from ..speed.run import machine, pareto
from ..study import plots
from ..study.pages import filled, table

PAGE, PLOT = "speed_in_the_picture.md", "speed_in_the_picture.png"
TITLES = {"hero": "A snake from afar", "macro": "Scales close by", "cd": "A disc"}
ENGINES = {"cycles": "Cycles", "eevee": "EEVEE"}


def write_page(tables: list[dict], arguments: argparse.Namespace) -> None:
    """Write the page and its plot into a folder."""
    import bpy

    images = arguments.output / "images"
    images.mkdir(parents=True, exist_ok=True)
    plot(tables, images / PLOT)
    page = text(tables, arguments, on=machine(), blender=bpy.app.version_string)
    write_whole(arguments.output / PAGE, lambda partial: partial.write_text(page, encoding="utf-8"))


def text(tables: list[dict], arguments: argparse.Namespace, *, on: Machine, blender: str) -> str:
    """The page in Markdown, with the figures of a run."""
    command = f"--width {arguments.width} --reference {arguments.reference} --most {arguments.most:g} --output docs"
    setting = [
        ["command", f"`./dev bench picture {command}`"],
        ["machine", f"{on.processor}, {on.cores} cores, no GPU"],
        ["Blender", blender],
        ["width of a picture", f"{arguments.width} pixels"],
        ["samples of the reference", f"{arguments.reference}"],
    ]
    figures = {
        "setting": table(["setting", "value"], setting),
        "references": _references(tables),
        "tables": "\n\n".join(map(section, tables)),
    }
    return filled(PAGE, figures)


def _references(tables: list[dict]) -> str:
    """The table of the errors of one half of each reference against the other half."""
    rows = []
    for each in tables:
        own = each["reference"]
        figures = [number(own["mean"], 2), f"{own['flip']:.4f}", number(own["seconds"])]
        rows.append([TITLES[each["scene"]], ENGINES[each["engine"]], *figures])
    return table(["scene", "compared with", "dE00 mean", "FLIP", "seconds"], rows)


def section(facts: dict) -> str:
    """A scene's table in one engine."""
    front = [facts["rows"][k] for k in pareto([(row["seconds"], row["flip"]) for row in facts["rows"]])]
    last = {row["method"]: row for row in facts["rows"]}  # the one with the most samples
    lines = [
        [f"**{row['method']}**" if row in front else row["method"], str(row["samples"]), number(row["seconds"]),
         number(row["mean"], 2), number(row["p95"], 2), f"{row['flip']:.4f}", f"{row['light']:.3f}"]
        for row in facts["rows"] if row in front or row is last[row["method"]]
    ]  # fmt: skip
    head = ("method", "samples", "seconds", "dE00 mean", "p95", "FLIP", "light")
    return f"## {TITLES[facts['scene']]}, {ENGINES[facts['engine']]}\n\n{table(head, lines)}"


def plot(tables: list[dict], path: Path) -> None:
    """FLIP over seconds, a panel for each scene and engine, a line for each method."""
    pyplot = plots.pyplot()
    figure, panels = pyplot.subplots(
        1, len(tables), figsize=(max(4.6 * len(tables), 8), 6), sharey=True, squeeze=False, layout="constrained"
    )
    names = list(dict.fromkeys(row["method"] for each in tables for row in each["rows"]))
    for panel, each in zip(panels[0], tables, strict=True):
        for name in names:
            points = [(row["seconds"], row["flip"]) for row in each["rows"] if row["method"] == name]
            if points:
                style = "--" if "footprint" in name else "-"
                panel.plot(*zip(*points, strict=True), style, marker="o", markersize=4, label=name, color=colour(name))
        panel.set(xscale="log", yscale="log", xlabel="seconds of a picture")
        panel.set_title(f"{TITLES[each['scene']]}, {each['engine']}")
        panel.grid(alpha=0.25)
    panels[0, 0].set_ylabel("FLIP, mean")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, loc="outside lower center", ncols=4)
    write_whole(path, lambda partial: figure.savefig(partial, dpi=80))
    pyplot.close(figure)


def colour(name: str) -> str:
    """A method's colour; footprint has that of the bake."""
    kinds = (
        "Direct dE 3",
        "Direct dE 1",
        "Direct dE 0.3",
        "OSL Direct",
        "OSL NMM",
        "OSL PQ",
    )
    known = (k for k, kind in enumerate(kinds) if name.startswith(kind))
    return f"C{next(known, len(kinds))}"
