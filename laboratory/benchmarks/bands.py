# SPDX-License-Identifier: GPL-3.0-or-later
"""How thick and how long the bands of colour on a rendered snake are, in scales.

    ./dev bench bands [FILE.blend] [--width 960] [--samples 32] [--json FILE]

FILE is a scene written by `./dev scenes`; by default the scene hero is built anew. It shows a snake of Add > Mesh >
Snake, whose attribute scale_random numbers its scales. The benchmark measures the diffraction pass alone, at the
picture's exposure. A pixel is lit if one of its channels reaches a tenth of display white. A lit pixel is coloured if
its smallest channel is below 0.6 of its largest, otherwise white. A band is a connected set of lit pixels of one kind.
Its thickness at a pixel is the side of the largest square inside the band that covers the pixel.
"""

import contextlib
import sys
from pathlib import Path

import numpy as np
import OpenEXR

from precompute.cli.arguments import count, path_argument
from precompute.cli.parser import OneLineParser
from sample_scenes import scenes

from .report import add_json, say, write

_LIT, _COLOURED = 0.1, 0.6
# The share of a scale's visible pixels that a band must cover, and the visible pixels that a scale must have.
_COVERED, _SEEN_MIN = 0.1, 12
_SCALE = "Scale"


def main(argv: list[str] | None = None) -> int:
    """Render the scene's diffraction and print the statistics of its bands."""
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
    """Statistics of a picture (rows, columns, 3), display white 1, with each pixel's scale number (0: none)."""
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
    """The median, or 0 for an empty array."""
    return float(np.median(values)) if len(values) else 0.0


def thickness_of(mask: np.ndarray, most: int) -> np.ndarray:
    """Side in pixels of the largest square inside a mask (rows, columns) that covers each pixel, at most `most`."""
    found = mask.astype(int)
    # Sums over the rectangles that start in the corner: a square lies within the mask if its sum equals its area.
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
    """Labels (rows, columns) of the connected parts of a mask, by 8 neighbours; 0 outside the mask."""
    labels = np.where(mask, np.arange(1, mask.size + 1).reshape(mask.shape), 0)
    while True:
        padded = np.pad(labels, 1)
        grown = labels
        for rows in range(3):
            for columns in range(3):
                grown = np.maximum(grown, padded[rows : rows + mask.shape[0], columns : columns + mask.shape[1]])
        grown = np.where(mask, grown, 0)
        # A label is the index of a pixel of the same part, so that pixel's own label is a shortcut to a larger one.
        flat = np.append(0, grown.ravel())
        grown = np.where(mask, np.maximum(grown, flat[grown]), 0)
        if (grown == labels).all():
            return labels
        labels = grown


def _longest(mask: np.ndarray, scales: np.ndarray, area: dict[float, int]) -> list[int]:
    """How many scales each of the five longest bands of a mask covers, longest first."""
    parts = components(mask)
    pairs, covered = np.unique(np.stack([parts[mask], scales[mask]], axis=1), axis=0, return_counts=True)
    runs = [
        part
        for (part, scale), pixels in zip(pairs, covered, strict=True)
        if area[scale] >= _SEEN_MIN and pixels >= _COVERED * area[scale]
    ]
    return sorted(np.unique(runs, return_counts=True)[1].tolist(), reverse=True)[:5]


def _steps_to(mask: np.ndarray, most: int) -> np.ndarray:
    """Distance (rows, columns) from each pixel to a mask in steps to one of 8 neighbours, at most `most`."""
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
    """Build the scene hero in Blender's folder for temporary files; returns its path."""
    import bpy

    version = ".".join(map(str, bpy.app.version[:2]))
    size = ["--width", "16", "--samples", "1"]
    with contextlib.redirect_stdout(sys.stderr):
        scenes.main(["--output", bpy.app.tempdir, "--scene", "hero", *size, "--bpy", version])
    return Path(bpy.app.tempdir) / "hero_cycles.blend"


def _add_scale_pass(scene) -> None:
    """Let every material write the number of its scale into a pass."""
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
    """Render a pass (rows, columns, 3) of the scene in Cycles, row 0 at the top."""
    import bpy

    scene, path = bpy.context.scene, Path(bpy.app.tempdir) / "bands.exr"
    settings = scene.render
    settings.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", samples, False
    scene.cycles.use_adaptive_sampling = False
    if samples == 1:  # a single point of each pixel, so that a pixel holds one scale
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
