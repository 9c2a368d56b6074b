# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against error: renders by every method, compared with a converged render of the same scene.

    ./dev bench picture [--scene hero|macro|cd ...] [--engine cycles|eevee ...] [--width 128]
        [--reference 2048] [--most 60] [--output docs] [--json FILE|-]

The scenes are those of studio.py: a snake from afar, a close-up of scales, a disc; only lamps light their gratings. The
reference is the mean of two renders by Cycles with different random numbers, in which the OSL shader evaluates Direct's
exact formula with a bake of dE 0.25. Each method takes the same place in the same material. Errors are the CIEDE2000
over the lit pixels (mean and 95th percentile, at the exposure that puts the 99th percentile of Y at 1), and the mean of
FLIP (Andersson and others, 2020) at that exposure. Seconds are processor seconds for all samples of a picture. They are
scaled from the picture with the most samples, minus a picture of a few pixels, which removes compiling and the scene's
preparation. A method stops once a picture takes more than a quarter of `--most` of these seconds.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.base.files import write_whole
from precompute.cli.arguments import count
from precompute.cli.arguments import number as number_argument
from precompute.cli.parser import OneLineParser
from precompute.colour.spaces import rgb_from_xyz
from precompute.methods import dft_images
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table import atlas

from ..speed.page import number
from ..speed.result import Machine, machine
from ..study import plots
from ..study.pages import filled, table, write_page
from . import report
from .blender import colour_differences, direct_shader_response, start_blender, thesis_response
from .studio import SCENES, Scene

SAMPLES = (1, 4, 16, 64, 256)
ENGINES = ("cycles", "eevee")
BUDGETS = (3.0, 1.0, 0.3)
_EXACT = 0.25
_BASE_PIXELS = 8
_TO_XYZ = np.linalg.inv(rgb_from_xyz("Rec.709")).T


@dataclass(frozen=True)
class Method:
    """A way to shade the grating: `wear` lets the scene's material use it."""

    name: str
    wear: Callable[[], None]
    osl: bool = False
    engines: tuple[str, ...] = ENGINES


def main(argv: list[str] | None = None) -> int:
    """Print the tables, write the page if requested, and return the exit status."""
    parser = OneLineParser(prog="./dev bench picture", description=__doc__.splitlines()[0])
    parser.add_argument("--scene", action="append", choices=list(SCENES))
    parser.add_argument("--engine", action="append", choices=ENGINES)
    parser.add_argument("--width", type=count(32, 4096), default=128)
    parser.add_argument("--reference", type=count(2, 1 << 20), default=2048, help="samples of the reference")
    parser.add_argument("--most", type=number_argument(1, 3600), default=60.0, metavar="S", help="seconds of a picture")
    parser.add_argument("--output", type=Path, metavar="DIR", help="write the page and its plot here")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    tables = []
    with tempfile.TemporaryDirectory() as folder:
        addon = start_blender(Path(folder))
        arguments.samples = 1
        for name in arguments.scene or SCENES:
            stage = Stage(Scene.built(addon, name, arguments, Path(folder)))
            truth, own = stage.reference(arguments.reference)
            report.say(f"\n{name}: the reference's own {as_text(own)}", arguments.json)
            for engine in arguments.engine or ENGINES:
                facts = {"scene": name, "engine": engine, "reference": own, "width": arguments.width, "rows": []}
                for row in stage.rows(engine, truth, arguments):
                    facts["rows"].append(row)
                    report.say(f"{engine:7}{row['method']:32}{row['samples']:5} {as_text(row)}", arguments.json)
                tables.append(facts)
    report.write({"tables": tables}, arguments.json)
    if arguments.output:
        write_files(tables, arguments)
    return 0


class Stage:
    """A scene whose only grating is shaded by one method after another."""

    def __init__(self, of: Scene):
        self.of, self.addon, self.folder = of, of.addon, of.pictures
        self.surface = f"sample:{SCENES[of.name][0]}"
        self.addon.making_materials.choose_lights(of.grating, "LAMPS")
        # Before Blender 5.1 Cycles traces shadow rays only in OSL: the reference would have shadows that methods lack.
        of.grating.shadows = False
        self.group = of.grating.group
        self.bakes: dict[float, Path] = {}
        # A smaller error limits a table to a shorter coherence: all bakes use that of the smallest error.
        self.coherence_length_m: float | None = None
        self.coherence_length_m = atlas.read(self.bake(_EXACT))[0].coherence_length_m

    def methods(self) -> list[Method]:
        """Every method, the cheapest first."""
        direct = [
            Method(
                f"Direct dE {budget:g}{', footprint' * footprint}",
                partial(self.wear_bake, budget, footprint),
                engines=ENGINES if budget == 1 else ENGINES[:1],
            )
            for budget in BUDGETS
            for footprint in (False, True)
        ]
        thesis = [
            Method(f"OSL {m.upper()}", partial(self.wear_thesis, m), True, ENGINES[:1]) for m in ("nmm", "pq", "flss")
        ]
        return [
            *direct,
            Method("OSL Direct dE 1", partial(self.wear_shader, 1.0), True, ENGINES[:1]),
            *thesis,
        ]

    def rows(self, engine: str, truth: np.ndarray, arguments: argparse.Namespace) -> Iterator[dict]:
        """A row for each method and number of samples."""
        for method in (each for each in self.methods() if engine in each.engines):
            self.of.scene.cycles.shading_system = method.osl
            method.wear()
            yield from self.row_of(method, engine, truth, arguments)

    def row_of(self, method: Method, engine: str, truth: np.ndarray, arguments: argparse.Namespace) -> Iterator[dict]:
        """A row for each number of samples of the method that the material has."""
        if engine == "eevee":  # the first picture of a size compiles more shaders
            self.render(engine, 1)
        base = min(self.render(engine, 1, _BASE_PIXELS)[0] for _ in range(2))
        rows = []
        for samples in SAMPLES:
            seconds, picture = self.render(engine, samples)
            rows.append({"method": method.name, "samples": samples, **errors(picture, truth)})
            if seconds - base > arguments.most / 4:
                break
        for row in rows:
            yield row | {"seconds": (seconds - base) * row["samples"] / samples}

    def reference(self, samples: int) -> tuple[np.ndarray, dict]:
        """The reference picture, and the errors of one of its halves against the other."""
        cycles = self.of.scene.cycles
        cycles.shading_system = True
        self.wear_shader(_EXACT)
        halves = []
        for cycles.seed in (1, 2):
            seconds, picture = self.render("cycles", samples // 2)
            halves.append(picture)
        cycles.seed = 0
        return np.mean(halves, axis=0), {"seconds": 2 * seconds, "samples": samples, **errors(*halves)}

    def render(self, engine: str, samples: int, width: int | None = None) -> tuple[float, np.ndarray]:
        """Processor seconds and the linear picture (rows, columns, 3)."""
        render, scene = self.of.scene.render, self.of.scene
        render.engine = "CYCLES" if engine == "cycles" else self.addon.compat.eevee_engine()
        scene.eevee.taa_render_samples, self.of.samples = samples, samples
        full = render.resolution_percentage
        render.resolution_percentage = max(100 * width // render.resolution_x, 1) if width else full
        start = time.process_time()
        picture = self.of.render("picture")
        seconds = time.process_time() - start
        render.resolution_percentage = full
        return seconds, picture

    def bake(self, budget: float) -> Path:
        """The file of a bake of the scene's surface."""
        if budget not in self.bakes:
            request = BakeRequest(delta_e=budget, coherence_length_m=self.coherence_length_m)
            folder = self.folder / f"{self.of.name}_{budget:g}_{len(self.bakes)}"
            facts = bake_to_folder([read_height_map(self.surface)], request, folder)
            self.bakes[budget] = Path(facts["files"][0])
        return self.bakes[budget]

    def wear_bake(self, budget: float, footprint: bool) -> None:
        """Use Direct as nodes."""
        response = self.addon.direct_response.direct_response(self.bake(budget))
        self.addon.lost_parts.replace_response(self.group, response)
        self.count_footprint(footprint)

    def count_footprint(self, counts: bool) -> None:
        """Switch the pixel footprint on or off in the grating's settings, which the material follows."""
        self.of.grating.footprint = counts
        self.addon.making_materials.follow_settings()

    def wear_shader(self, budget: float) -> None:
        """Use Direct as an OSL shader, which evaluates the formula exactly."""
        made = direct_shader_response(self.addon, self.bake(budget))
        self.count_footprint(False)
        self.addon.lost_parts.replace_response(self.group, made)

    def wear_thesis(self, name: str) -> None:
        """Use a thesis method as an OSL shader: 81 wavelengths, and texels that lose a thousandth of the light."""
        relief = prepare(read_height_map(self.surface))
        settings = dft_images.settings_for(step_m=5e-9, coherence_length_m=self.coherence_length_m)
        settings = replace(settings, texels=dft_images.texels_for(relief, settings))
        path = self.folder / f"{self.of.name}_{name}.exr"
        made = thesis_response(self.addon, name, relief, settings, path=path)
        self.count_footprint(False)
        self.addon.lost_parts.replace_response(self.group, made)


def errors(picture: np.ndarray, truth: np.ndarray) -> dict:
    """CIEDE2000 and FLIP of a linear picture at the truth's exposure, and its light relative to the truth's."""
    import flip_evaluator

    differences = colour_differences(picture, truth)
    level = np.percentile(truth @ _TO_XYZ[:, 1], 99)
    shown = [np.clip(each / level, 0, 1).astype(np.float32) for each in (truth, picture)]
    flip = flip_evaluator.evaluate(*shown, "LDR", inputsRGB=False, applyMagma=False)[1]
    light = float(picture.mean() / truth.mean())
    return {
        "mean": float(differences.mean()), "p95": float(np.percentile(differences, 95)), "flip": float(flip),
        "light": light,
    }  # fmt: skip


def as_text(row: dict) -> str:
    """The printed figures of a row."""
    return (
        f"{row['seconds']:9.3f} s  dE00 {row['mean']:6.2f} mean {row['p95']:6.2f} p95  FLIP {row['flip']:.4f}  light "
        f"{row['light']:.3f}"
    )


PAGE, PLOT = "speed.md", "speed_in_the_picture.png"
# The names of this program's places in the page begin so.
PART = "picture "
TITLES = {"hero": "A snake from afar", "macro": "Scales close by", "cd": "A disc"}
_ENGINE_TITLES = {"cycles": "Cycles", "eevee": "EEVEE"}
# Bakes whose rows the page leaves out; the command prints them.
_OTHER_BAKES = tuple(f"Direct dE {budget:g}" for budget in BUDGETS if budget != 1)


def write_files(tables: list[dict], arguments: argparse.Namespace) -> None:
    """Write the page and its plot into a folder."""
    import bpy

    images = arguments.output / "images"
    images.mkdir(parents=True, exist_ok=True)
    plot(tables, images / PLOT)
    page = text(tables, arguments, on=machine(), blender=bpy.app.version_string)
    write_page(arguments.output, PAGE, page, part=PART)


def text(tables: list[dict], arguments: argparse.Namespace, *, on: Machine, blender: str) -> str:
    """The page in Markdown, with the figures of a run."""
    chosen = "".join(f"--scene {name} " for name in arguments.scene or ())
    chosen += "".join(f"--engine {name} " for name in arguments.engine or ())
    command = f"--width {arguments.width} --reference {arguments.reference} --most {arguments.most:g} --output docs"
    setting = [
        ["command", f"`./dev bench picture {chosen}{command}`"],
        ["machine", f"{on.processor}, {on.cores} cores, no GPU"],
        ["Blender", blender],
    ]
    figures = {
        "picture setting": table(["setting", "value"], setting),
        "picture methods": methods(tables),
    }
    return filled(PAGE, figures, part=PART)


def methods(tables: list[dict]) -> str:
    """The table of each scene and engine: the reference's own error, and of each method the picture with the most
    samples. Of the bakes it has the one of dE 1."""
    head = ("scene, engine", "method", "samples", "seconds", "dE00 mean", "FLIP")
    lines = []
    for each in tables:
        title = f"{TITLES[each['scene']]}, {_ENGINE_TITLES[each['engine']]}"
        own = each["reference"] | {"method": "half of the reference", "samples": "-"}
        last = {row["method"]: row for row in each["rows"]}  # the one with the most samples
        for row in (own, *(row for name, row in last.items() if not name.startswith(_OTHER_BAKES))):
            cells = [str(row["samples"]), number(row["seconds"]), number(row["mean"], 2), f"{row['flip']:.4f}"]
            lines.append([title, row["method"], *cells])
    return table(head, lines)


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
