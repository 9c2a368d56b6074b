# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender on an open file: `--python nightly_in_blender.py -- ENGINE FOLDER KNOWN [record]` renders a picture
and compares it with KNOWN: with the numbers in a .json, or pixel by pixel with an .exr. `record` writes the numbers.

The numbers are the means of the picture's cells, with the noise in each. FOLDER gets ENGINE.exr, ENGINE.png and
ENGINE_difference.exr, the relative difference of each cell."""

import json
import sys
from pathlib import Path

import bpy
import numpy as np

PIXELS, CELLS, SAMPLES = 256, 16, 16
_SIDE = PIXELS // CELLS
# Standard deviations of the difference of two means. A wrong alarm in one of 768 cells and channels then has a chance
# of 768 * 5.7e-7 = 4e-4.
_DEVIATIONS = 5.0
# Rounding, relative to a value. Cycles reads a table of half floats, of 11 bits, twice in a product. EEVEE's textures
# have 8 bits for the weights between two texels.
_ROUNDING = {"CYCLES": 2 * 2**-11, "EEVEE": 2**-8}
# Values below this share of the brightest are compared as if they were as large: half floats have no finer steps there.
_FLOOR = 1e-3


def main() -> None:
    engine, folder, known_path, *options = sys.argv[sys.argv.index("--") + 1 :]
    output, path = Path(folder), Path(known_path)
    picture = render(engine, output)
    if path.suffix == ".exr":
        assert np.array_equal(picture, read(path)), f"{engine}: another picture than {path}"
        return
    found = numbers(picture)
    known = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    if options == ["record"]:
        known[engine] = {name: np.round(values, 7).tolist() for name, values in found.items()}
        path.write_text(json.dumps(known) + "\n", encoding="utf-8")
        return
    wanted = {name: np.array(values) for name, values in known[engine].items()}
    difference = found["mean"] - wanted["mean"]
    allowed = tolerance(found, wanted, engine)
    scale = np.maximum(wanted["mean"], _FLOOR * wanted["mean"].max())
    write_cells(difference / scale, output / f"{engine}_difference.exr")
    worst = float((abs(difference) / allowed).max())
    outside = int((abs(difference) > allowed).sum())
    print(
        f"{engine}: {outside} of {difference.size} cells differ; the largest has {worst:.2f} of the allowed difference"
    )
    print(f"{engine}: mean {found['mean'].mean():.6f}, recorded {wanted['mean'].mean():.6f}")
    assert not outside, f"{engine}: the picture differs; see {engine}_difference.exr"


def render(engine: str, output: Path) -> np.ndarray:
    """Render the open file, and write it as ENGINE.exr and ENGINE.png. Returns linear colours (rows, cols, 3)."""
    scene = bpy.context.scene
    eevee = "BLENDER_EEVEE" if bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT"
    scene.render.engine = eevee if engine == "EEVEE" else engine
    scene.cycles.samples = scene.eevee.taa_render_samples = SAMPLES
    scene.cycles.device, scene.cycles.seed = "CPU", 0
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    scene.render.resolution_x = scene.render.resolution_y = PIXELS
    scene.render.resolution_percentage = 100
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    path = output / f"{engine}.exr"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    settings.file_format = "PNG"
    bpy.data.images["Render Result"].save_render(str(output / f"{engine}.png"), scene=scene)
    return read(path)


def read(path: Path) -> np.ndarray:
    """A picture's linear colours (rows, cols, 3)."""
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.is_data = True
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(PIXELS, PIXELS, -1)[..., :3].astype(float)


def numbers(picture: np.ndarray) -> dict[str, np.ndarray]:
    """The mean of each cell (CELLS, CELLS, 3), and the standard deviation of a pixel's noise there.

    Second differences have 6 times the variance of a pixel. They hold the picture's own bends too, so the noise is
    never too small."""
    bends = np.diff(np.pad(picture, ((0, 0), (1, 1), (0, 0)), mode="reflect"), n=2, axis=1)
    return {"mean": in_cells(picture), "noise": np.sqrt(in_cells(bends**2) / 6)}


def in_cells(values: np.ndarray) -> np.ndarray:
    return values.reshape(CELLS, _SIDE, CELLS, _SIDE, 3).mean(axis=(1, 3))


def tolerance(found: dict[str, np.ndarray], wanted: dict[str, np.ndarray], engine: str) -> np.ndarray:
    """The allowed difference of each cell's mean, of _SIDE * _SIDE pixels in each picture."""
    noise = np.hypot(found["noise"], wanted["noise"]) / _SIDE
    return _DEVIATIONS * noise + _ROUNDING[engine] * np.maximum(wanted["mean"], _FLOOR * wanted["mean"].max())


def write_cells(cells: np.ndarray, path: Path) -> None:
    """Write cells as a picture of the render's size."""
    image = bpy.data.images.new(path.stem, PIXELS, PIXELS, float_buffer=True)
    opaque = np.ones((PIXELS, PIXELS, 4), np.float32)
    opaque[..., :3] = np.kron(cells, np.ones((_SIDE, _SIDE, 1)))
    image.pixels.foreach_set(opaque.ravel())
    image.file_format, image.filepath_raw = "OPEN_EXR", str(path)
    image.save()


main()
