# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's evaluation done again: this command makes docs/evaluation.md with all its pictures and numbers.

    python -m benchmarks evaluation [--output docs] [--shared DIR] [--json FILE|-]

DIR is the folder of real scans, by default shared/data beside the repository. Where it exists, the scan of Elaphe is
used, and sheets that show the thesis's pictures beside ours are written to OUTPUT/thesis_comparison, which is not
committed. Where it does not exist, sample surfaces take the place of the scan.
"""

import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from benchmarks import evaluation_page, report, terms
from benchmarks.evaluation_maps import COHERENCES_UM, Map, groups
from precompute.bake.ensemble import plan
from precompute.cli.parser import OneLineParser
from precompute.colour.observer import wavelengths
from precompute.methods.method import Settings
from precompute.methods.registry import DEFAULT_METHODS, METHODS
from precompute.study import brdf_map, evaluation, evaluation_plot, slits
from precompute.study.colour_comparison import compare_bake
from precompute.study.response import WINDOW, FirstOrder, first_order_plane, response
from precompute.surface.height_map import HeightMap
from precompute.surface.readers.registry import read_height_map
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.gratings import blazed
from precompute.surface.unit_cell import grating_period

ROOT = Path(__file__).resolve().parents[1]
PIXELS = 256
THETA_I = np.radians(75)
THESIS_ELAPHE_M = 1144.26e-9


@dataclass(frozen=True)
class Row:
    """One line of a table: an evaluation, and the mean and variance in nm that the thesis gives, if it does."""

    label: str
    evaluation: evaluation.Evaluation
    thesis: str = ""


def height_maps(shared: Path) -> dict[str, HeightMap]:
    """The surfaces by name; "elaphe" is the scan where there is one.

    The blazes of few periods are the same endless surface cut into a smaller patch. They are for short coherence
    lengths, because FLSS reads only a few texels around a frequency."""
    scan = shared / "snake" / "elaphe_65um.png"
    surfaces = {
        "blaze": read_height_map("sample:blazed"),
        "elaphe": read_height_map(str(scan), 65, 375) if scan.exists() else read_height_map("sample:elaphe"),
        "xenopeltis": read_height_map("sample:xenopeltis"),
    }
    skin = surfaces["elaphe"]
    surfaces["elaphe, half"] = replace(skin, height_m=skin.height_m / 2)
    for um in COHERENCES_UM:
        periods = max(1, round(um / 2.5))
        surfaces[f"blaze of {periods}"] = blazed(periods=periods, rows=32 * periods)
    return surfaces


def draw_maps(wanted: dict[str, list[Map]], reliefs: dict[str, Relief], folder: Path, target: str | None) -> None:
    """Write every map; a method that is asked for several pictures is built once."""
    built = {}
    for one in (one for group in wanted.values() for one in group):
        started = time.perf_counter()
        relief = reliefs[one.surface]
        theta_i = np.radians(one.theta_i_deg)
        if one.method == "reference":
            sigma_b = plan(relief).sigma_b
            xyz = brdf_map.from_reference(relief, sigma_b, PIXELS, theta_i=theta_i, step_m=5e-9)
        else:
            key = one.surface, one.method, tuple(one.changes.items())
            if key not in built:
                built = {key: METHODS[one.method](relief, Settings(**one.changes))}
            xyz = brdf_map.from_method(built[key], PIXELS, theta_i)
        picture = brdf_map.picture(xyz, percentile=one.percentile)
        Image.fromarray(coarser(picture)).save(folder / f"{one.name}.png", optimize=True)
        report.say(f"  {one.name}: {time.perf_counter() - started:.1f} s", target)


def coarser(picture: np.ndarray) -> np.ndarray:
    """A picture with its 8-bit values in steps of 4, which no eye sees in speckle. The files are a third smaller."""
    return np.minimum(np.rint(picture / 4) * 4, 255).astype(np.uint8)


def save_small(picture: Image.Image, path: Path) -> None:
    """Write a plot in a palette of 255 colours, a third of the bytes. A map would show the palette."""
    picture.convert("RGB").quantize(255, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE).save(path, optimize=True)


def blaze_rows(surface: HeightMap) -> list[Row]:
    """The rows of the blaze: every method, and FLSS with light from the other side."""
    thesis = {"flss": "2499.997 / 0.377", "nmm": "2499.997 / 0.377"}
    relief, other = prepare(surface), prepare(evaluation.turned(surface, 0))
    settings, first_order = evaluation.thesis_settings(period_m=2.5e-6), FirstOrder(THETA_I, 2.5e-6)
    rows = [
        Row(name, evaluation.evaluate_method(name, relief, settings, first_order=first_order), thesis.get(name, ""))
        for name in DEFAULT_METHODS
    ]
    texels = replace(settings, texels=21)
    rows += [
        Row(
            "pq, 21 x 21 texels",
            evaluation.evaluate_method("pq", prepare(blazed(rows=64)), texels, first_order=first_order),
            "2502.428 / 0.390",
        ),
        Row("flss, light from +T", evaluation.evaluate_method("flss", other, settings, first_order=first_order)),
    ]
    return rows  # fmt: skip


def elaphe_rows(surface: HeightMap) -> list[Row]:
    """The rows of Elaphe: every method, then variations.

    The variations show how the period depends on the speckle of one patch and on the way the patch is cut out."""
    thesis = {"flss": "1144.262 / 0.401", "nmm": "1144.179 / 0.677", "pq-printed": "1052.308 / 49.7"}
    relief, other = prepare(surface), prepare(evaluation.turned(surface, 0))
    around = grating_period(relief)
    settings = evaluation.thesis_settings(period_m=around)

    def row(label, name, what, settings, thesis=""):
        return Row(
            label, evaluation.evaluate_method(name, what, settings, first_order=FirstOrder(THETA_I, around)), thesis
        )

    rows = [row(name, name, relief, settings, thesis.get(name, "")) for name in DEFAULT_METHODS]
    told = replace(settings, period_m=THESIS_ELAPHE_M)
    rows += [
        row("nmm, told 1144.26 nm", "nmm", relief, told, thesis["nmm"]),
        row("flss, light from +T", "flss", other, settings),
        row("flss, cut as the thesis", "flss", as_the_thesis_cuts(other), settings, thesis["flss"]),
    ]
    wide = replace(settings, coherence_length_m=None)
    rows += [
        row("reference, 30 areas", "reference", relief, wide),
        row("reference, 30 areas, from +T", "reference", other, wide),
    ]
    return rows


def as_the_thesis_cuts(relief: Relief) -> Relief:
    """Raw edges, no apodisation, and the coherence window centred on the patch's corner, where its seams cross."""
    middle = tuple(n // 2 for n in relief.height_m.shape)
    return replace(
        relief,
        apodisation_axes=tuple(np.ones(n) for n in relief.height_m.shape),
        height_m=np.roll(relief.height_m, middle, (0, 1)),
    )


def xenopeltis_rows(surface: HeightMap) -> list[Row]:
    """The rows of Xenopeltis: every method in the plane along the fingers.

    The Taylor series is summed in float64, because float32 leaves it no digits at 819 nm of relief."""
    relief = prepare(evaluation.turned(surface, 90))
    around = grating_period(relief)
    settings, first_order = evaluation.thesis_settings(period_m=around, dtype=np.float64), FirstOrder(THETA_I, around)
    thesis = {"flss": "1552.27 / 0.45"}
    return [
        Row(name, evaluation.evaluate_method(name, relief, settings, first_order=first_order), thesis.get(name, ""))
        for name in DEFAULT_METHODS
        if name != "stam"
    ]


def grid_variance(surface: HeightMap, step_deg: float) -> float:
    """Variance of the period in square nanometres on the blaze when each peak is the highest sample of a grid of
    angles.

    The thesis takes its peaks so."""
    relief, lambdas = prepare(surface), wavelengths(5e-9)
    plane = first_order_plane(THETA_I, lambdas, 2.5e-6, step=np.radians(step_deg))
    method = METHODS["chebyshev"](relief, evaluation.thesis_settings())
    order = np.abs(plane.u) * 2.5e-6 / lambdas[:, None]
    found = response(method, plane, lambdas) * (np.abs(order - 1) < WINDOW)
    return float(np.var(lambdas / np.abs(plane.u[found.argmax(axis=1)]) * 1e9))


def patch_spread(surface: HeightMap, parts: int = 3) -> list[float]:
    """The periods in nanometres that FLSS over Chebyshev images finds in each of parts x parts pieces of a scan.

    Each piece is 65 / parts um long."""
    rows, cols = (n // parts for n in surface.height_m.shape)
    around = grating_period(prepare(surface))
    found = []
    for k in range(parts * parts):
        y, x = (k // parts) * rows, (k % parts) * cols
        piece = replace(surface, height_m=surface.height_m[y : y + rows, x : x + cols], periodic=False)
        relief = prepare(piece)
        settings = evaluation.thesis_settings(coherence_length_m=relief.size_m[1])
        one = evaluation.evaluate_method("chebyshev", relief, settings, first_order=FirstOrder(THETA_I, around))
        found.append(one.as_dict()["period_mean_nm"])
    return found


def sheets(wanted: dict[str, list[Map]], images: Path, shared: Path, folder: Path) -> None:
    """Write a sheet for each section that has pictures of the thesis, our maps above those of the thesis."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = shared / "thesis_figures"
    for name, group in wanted.items():
        pairs = [one for one in group if one.thesis and (figures / f"{one.thesis}.png").exists()]
        if not pairs:
            continue
        sheet = Image.new("RGB", (len(pairs) * (PIXELS + 8), 2 * (PIXELS + 20)), "white")
        draw = ImageDraw.Draw(sheet)
        for k, one in enumerate(pairs):
            left = k * (PIXELS + 8)
            sheet.paste(Image.open(images / f"{one.name}.png").convert("RGB"), (left, 0))
            sheet.paste(on_white(figures / f"{one.thesis}.png", PIXELS), (left, PIXELS + 20))
            draw.text((left + 4, PIXELS + 2), f"ours: {one.caption}", fill="black")
            draw.text((left + 4, 2 * PIXELS + 22), one.thesis.removeprefix("brdfmap__"), fill="black")
        sheet.save(folder / f"{name}.png")


def on_white(path: Path, pixels: int) -> Image.Image:
    """A picture with transparency, over white, resized to a square."""
    picture = Image.open(path).convert("RGBA")
    white = Image.new("RGBA", picture.size, "white")
    white.alpha_composite(picture)
    return white.convert("RGB").resize((pixels, pixels), Image.Resampling.LANCZOS)


def response_sheets(plots: dict[str, Path], shared: Path, folder: Path) -> None:
    """Write sheets with our response plots above those of the thesis for the same surface."""
    for name, plot in plots.items():
        theirs = sorted((shared / "thesis_figures").glob(f"evaluation__verification__*_{name}.png"))
        if not theirs:
            continue
        ours = Image.open(plot).convert("RGB")
        pictures = [Image.open(path).convert("RGB").resize((512, 325)) for path in theirs]
        sheet = Image.new("RGB", (max(ours.width, 520 * len(pictures)), ours.height + 345), "white")
        sheet.paste(ours, (0, 0))
        for k, picture in enumerate(pictures):
            sheet.paste(picture, (520 * k, ours.height + 20))
            ImageDraw.Draw(sheet).text((520 * k + 4, ours.height + 4), theirs[k].stem, fill="black")
        sheet.save(folder / f"response-{name}.png")


def main(argv: list[str] | None = None) -> None:
    """Compute everything and write the page."""
    parser = OneLineParser(prog="python -m benchmarks evaluation", description="Makes docs/evaluation.md.")
    parser.add_argument("--output", type=Path, default=ROOT / "docs", metavar="DIR")
    parser.add_argument("--shared", type=Path, default=ROOT.parent / "shared" / "data", metavar="DIR")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    started = time.perf_counter()
    images = arguments.output / "images" / "evaluation"
    images.mkdir(parents=True, exist_ok=True)
    surfaces = height_maps(arguments.shared)

    tables = {
        "blaze": blaze_rows(surfaces["blaze"]),
        "elaphe": elaphe_rows(surfaces["elaphe"]),
        "xenopeltis": xenopeltis_rows(surfaces["xenopeltis"]),
    }
    bakes = {}
    plots = {}
    for name, rows in tables.items():
        azimuth = 90 if name == "xenopeltis" else 180
        relief = prepare(evaluation.turned(surfaces[name], azimuth))
        bakes[name] = compare_bake(relief, Settings(), FirstOrder(THETA_I, rows[0].evaluation.expected_m))
        plain = [row.evaluation for row in rows if row.label in METHODS]
        plots[name] = images / f"response-{name}.png"
        evaluation_plot.plot(plots[name], plain)
        save_small(Image.open(plots[name]), plots[name])
        report.say(f"  {name} evaluated, {time.perf_counter() - started:.0f} s", arguments.json)
    facts = evaluation_page.Facts(
        scan=not surfaces["elaphe"].source.startswith("sample:"),
        tables=tables,
        bakes=bakes,
        grid_variance=grid_variance(surfaces["blaze"], 0.017),
        patches=patch_spread(surfaces["elaphe"]),
        terms=terms.table(),
    )
    terms.plot(images / "terms.png")
    save_small(Image.open(images / "terms.png"), images / "terms.png")
    slits.plot(images / "slits.png")
    wanted = groups()
    draw_maps(wanted, {name: prepare(surface) for name, surface in surfaces.items()}, images, arguments.json)
    (arguments.output / "evaluation.md").write_text(evaluation_page.text(facts, wanted))
    if (arguments.shared / "thesis_figures").is_dir():
        comparison = arguments.output / "thesis_comparison"
        sheets(wanted, images, arguments.shared, comparison)
        response_sheets({"blazed": plots["blaze"], "elaphe": plots["elaphe"]}, arguments.shared, comparison)
    seconds = time.perf_counter() - started
    report.say(f"{arguments.output / 'evaluation.md'}: {seconds:.0f} s", arguments.json)
    report.write({**facts.as_dict(), "seconds": seconds}, arguments.json)


if __name__ == "__main__":
    main()
