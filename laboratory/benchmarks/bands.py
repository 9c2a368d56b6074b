# SPDX-License-Identifier: GPL-3.0-or-later
"""How broad and how long the bands of colour on a snake are, in scales, as a picture shows them.

    ./dev bench bands [FILE.blend] [--width 960] [--samples 32] [--json FILE]

FILE is a scene that `./dev scenes` wrote, by default its hero, which is made anew: a snake of Add > Mesh > Snake, whose
scales the attribute scale_random tells apart. What is measured is its diffraction alone, at the picture's exposure. A
pixel is lit if it has a tenth of display white in some channel; it is coloured if its least channel is below 0.6 of its
greatest, else white. A band is a set of lit pixels of one kind that touch. Its thickness at a pixel is the side of the
largest square of such pixels that covers the pixel.
"""

import contextlib
import sys
from pathlib import Path

import numpy as np
import OpenEXR

from precompute.cli.option_types import count, path_argument
from precompute.cli.parser import OneLineParser
from sample_scenes import scenes

from .report import add_json, say, write

_LIT, _COLOURED = 0.1, 0.6
# A band runs over a scale if it covers this share of what is seen of the scale, and a scale counts of which so many
# pixels are seen.
_COVERED, _SEEN_MIN = 0.1, 12
_SCALE = "Scale"


def main(argv: list[str] | None = None) -> int:
    """Render the scene's diffraction and print what its bands are like."""
    import bpy

    parser = OneLineParser(prog="./dev bench bands", description=__doc__.splitlines()[0])
    parser.add_argument("file", type=path_argument, metavar="FILE.blend", nargs="?", help="default: the scene hero")
    parser.add_argument("--width", type=count(64, 8192), default=960)
    parser.add_argument("--samples", type=count(1, 1 << 16), default=32)
    add_json(parser)
    arguments = parser.parse_args(argv)

    bpy.ops.wm.open_mainfile(filepath=str((arguments.file or _hero()).resolve()))
    _add_scale_pass(bpy.context.scene)
    diffraction = _render(arguments, "Diffraction", samples=arguments.samples)
    scales = _render(arguments, _SCALE, samples=1)[..., 0]
    facts = measure(diffraction * 2.0**bpy.context.scene.view_settings.exposure, np.round(scales, 6))
    say(
        "{scales} scales are seen, {scale_px:.1f} pixels wide; lit are {coloured_share:.1%} of them in colours and "
        "{white_share:.1%} in white\nlongest bands of colour: over {longest} scales; of white: over {longest_white}\n"
        "thickness of colour: median {thickness:.2f} scales, under a tenth of a scale {thin_share:.1%}\n"
        "from colour to the nearest white: median {to_white:.1f} scales".format(**facts),
        arguments.json,
    )
    write(facts, arguments.json)
    return 0


def measure(light: np.ndarray, scales: np.ndarray) -> dict[str, object]:
    """The facts of a picture (rows, columns, 3) whose display white is 1, with the number of the scale that each pixel
    shows (rows, columns), 0 for none."""
    greatest, least = light.max(axis=-1), light.min(axis=-1)
    lit = (greatest > _LIT) & (scales > 0)
    coloured = lit & (least < _COLOURED * greatest)
    white = lit & ~coloured
    numbers, area = np.unique(scales[scales > 0], return_counts=True)
    whole = area >= _SEEN_MIN
    side = float(np.median(np.sqrt(area[whole])))
    thickness = thickness_of(coloured, int(4 * side)) / side
    return {
        "scales": int(whole.sum()),
        "scale_px": side,
        "coloured_share": float(coloured.sum() / (scales > 0).sum()),
        "white_share": float(white.sum() / (scales > 0).sum()),
        "longest": _longest(coloured, scales, dict(zip(numbers, area, strict=True))),
        "longest_white": _longest(white, scales, dict(zip(numbers, area, strict=True))),
        "thickness": _median(thickness[coloured]),
        "thin_share": float((thickness[coloured] < 0.1).sum() / max(1, coloured.sum())),
        "to_white": _median(_steps_to(white, int(8 * side))[coloured] / side),
    }


def _median(values: np.ndarray) -> float:
    """The median; 0 of nothing."""
    return float(np.median(values)) if len(values) else 0.0


def thickness_of(mask: np.ndarray, most: int) -> np.ndarray:
    """The side in pixels of the largest square within a mask (rows, columns) that covers a pixel, at most `most`; 0
    outside of it."""
    found = mask.astype(int)
    # The sums over all rectangles from the corner on: a square lies within the mask if its sum is its area.
    sums = np.pad(mask.astype(int).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    for side in range(2, min(most, *mask.shape) + 1):
        inside = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side] == side**2
        if not inside.any():
            break
        covered = np.zeros((mask.shape[0] + 1, mask.shape[1] + 1), int)
        for rows, columns, sign in ((0, 0, 1), (side, 0, -1), (0, side, -1), (side, side, 1)):
            covered[rows : rows + inside.shape[0], columns : columns + inside.shape[1]] += sign * inside
        found[covered.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0] = side
    return found


def components(mask: np.ndarray) -> np.ndarray:
    """The number of the connected part (rows, columns) that a pixel of a mask is in, by 8 neighbours; 0 outside."""
    labels = np.where(mask, np.arange(1, mask.size + 1).reshape(mask.shape), 0)
    while True:
        padded = np.pad(labels, 1)
        grown = labels
        for rows in range(3):
            for columns in range(3):
                grown = np.maximum(grown, padded[rows : rows + mask.shape[0], columns : columns + mask.shape[1]])
        grown = np.where(mask, grown, 0)
        # A pixel's label names a pixel of its part: that pixel's own label leads further at once.
        flat = np.append(0, grown.ravel())
        grown = np.where(mask, np.maximum(grown, flat[grown]), 0)
        if (grown == labels).all():
            return labels
        labels = grown


def _longest(mask: np.ndarray, scales: np.ndarray, area: dict[float, int]) -> list[int]:
    """Over how many scales the five longest bands of a mask run."""
    parts = components(mask)
    pairs, covered = np.unique(np.stack([parts[mask], scales[mask]], axis=1), axis=0, return_counts=True)
    runs = [
        part
        for (part, scale), pixels in zip(pairs, covered, strict=True)
        if area[scale] >= _SEEN_MIN and pixels >= _COVERED * area[scale]
    ]
    return sorted(np.unique(runs, return_counts=True)[1].tolist(), reverse=True)[:5]


def _steps_to(mask: np.ndarray, most: int) -> np.ndarray:
    """How many steps to one of 8 neighbours lead from a pixel to a mask (rows, columns); `most` if there are more."""
    steps, reached = np.full(mask.shape, most), mask.copy()
    steps[mask] = 0
    for step in range(1, most):
        padded = np.pad(reached, 1)
        reached = np.logical_or.reduce(
            [padded[i : i + mask.shape[0], j : j + mask.shape[1]] for i in range(3) for j in range(3)]
        )
        steps[reached & (steps == most)] = step
    return steps


def _hero() -> Path:
    """The scene hero, made in Blender's folder for temporary files."""
    import bpy

    version = ".".join(map(str, bpy.app.version[:2]))
    size = ["--width", "16", "--samples", "1"]
    with contextlib.redirect_stdout(sys.stderr):
        scenes.main(["--output", bpy.app.tempdir, "--scene", "hero", *size, "--bpy", version])
    return Path(bpy.app.tempdir) / "hero_cycles.blend"


def _add_scale_pass(scene) -> None:
    """Have every material tell the number of the scale that a pixel shows."""
    import bpy

    for name in ("Diffraction", _SCALE):
        aov = scene.view_layers[0].aovs.add()
        aov.name, aov.type = name, "COLOR"
    for material in (m for m in bpy.data.materials if m.node_tree is not None):
        nodes = material.node_tree.nodes
        held, told = nodes.new("ShaderNodeAttribute"), nodes.new("ShaderNodeOutputAOV")
        held.attribute_name, told.aov_name = "scale_random", _SCALE
        material.node_tree.links.new(held.outputs["Fac"], told.inputs["Color"])


def _render(arguments, channel: str, *, samples: int) -> np.ndarray:
    """A pass (rows, columns, 3) of the scene in Cycles, row 0 at the top."""
    import bpy

    scene, path = bpy.context.scene, Path(bpy.app.tempdir) / "bands.exr"
    settings = scene.render
    settings.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", samples, False
    scene.cycles.use_adaptive_sampling = False
    if samples == 1:  # one place of a pixel has one scale
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    settings.resolution_y = settings.resolution_y * arguments.width // settings.resolution_x
    settings.resolution_x, settings.resolution_percentage = arguments.width, 100
    image = settings.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
    settings.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {
            tuple(key.split(".")[-2:]): value.pixels for part in file.parts for key, value in part.channels.items()
        }
    return np.stack([np.asarray(channels[channel, each], float) for each in "RGB"], axis=-1)
