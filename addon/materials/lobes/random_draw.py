# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing a random texel of a sample set and a random wavelength in each shading sample.

The White Noise node turns the shaded position into three random numbers. Positions differ, so each sample is a new
draw. Two numbers choose a texel, and the third chooses a wavelength."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from statistics import NormalDist

import bpy
import numpy as np

from ....precompute.colour.drawn_wavelengths import wavelength_quantiles
from ....precompute.reflectance.matter import Matter
from ....precompute.table.sample_set import SampleSetLayout
from ...blender import stored
from ...nodes.builder import Tree, Value
from ..pictures import fault_of, note_content, picture_of

# Columns and rows of the picture of wavelengths and normal numbers.
_WAVELENGTHS, _NORMALS = 512, 16
# Columns (wavelengths) and rows (cosines) of a picture of a reflectance.
_COLUMNS, _ROWS = 256, 512
# Custom property of the picture of wavelengths: what it holds.
_ILLUMINANT = "ng_wavelengths"


@dataclass(frozen=True)
class Draw:
    """A random draw.

    q           both components of the frequency q, times the sample set's wavelength
    wavelength  over the sample set's wavelength
    normals     two independent standard normal numbers
    weight      W / wavelength^2 of the frequency over the layout's scale, as a function of s times the sample set's
                wavelength
    reflectance the matter's reflectance at the drawn wavelength, as a function of the half angle's cosine; 1 without
                a picture of it"""

    q: tuple[Value, Value]
    wavelength: Value
    normals: tuple[Value, Value]
    weight: Callable[[Value], Value]
    reflectance: Callable[[Value], Value | float]


@dataclass(frozen=True)
class SampleSetNodes:
    """A sample set for nodes: its picture, the picture's layout, the picture of wavelengths and normal numbers, and the
    picture of the reflectance if the table holds its matter's."""

    image: bpy.types.Image
    layout: SampleSetLayout
    wavelengths: bpy.types.Image
    reflectance: bpy.types.Image | None = None

    def add_to(self, tree: Tree, place: Value) -> Draw:
        """Add nodes that draw at random by the shaded position."""
        layout = self.layout
        noise = tree.node("ShaderNodeTexWhiteNoise", place, noise_dimensions="3D")
        x, y, share = _parts(tree, tree.value(noise.outputs["Color"]))
        # The digits of x below the width of a texel, which it chooses, are a further random number.
        further = tree.math("FRACT", x * float(layout.size))
        drawn, _ = _look_up(tree, self.wavelengths, tree.vector(share, further, 0.0), label="Wavelength")
        wavelength, *normals = _parts(tree, drawn)
        x, y = x * (1 / layout.columns), y * (1 / layout.rows)
        rounded, alpha = _look_up(tree, self.image, tree.vector(x, y, 0.0), label="q")
        red, green, blue = _parts(tree, rounded)

        def weight(s: Value) -> Value:
            along = s.times_plus(layout.pieces / layout.s_last, 1.0)
            tile = tree.minimum(tree.math("FLOOR", along), float(layout.pieces)) if layout.pieces > 1 else None
            t = (along - (1.0 if tile is None else tile)).times_plus(2.0, -1.0)
            colour, third = _look_up(tree, self.image, _in_tile(tree, (x, y), layout, tile), label="W")
            zeroth, first, second = _parts(tree, colour)
            return third.times_plus(t, second).times_plus(t, first).times_plus(t, zeroth)

        def reflectance(cosine: Value) -> Value | float:
            if self.reflectance is None:
                return 1.0
            return _parts(tree, tree.image(self.reflectance, tree.vector(share, cosine, 0.0), "Reflectance"))[0]

        return Draw((red + blue, green + alpha), wavelength, (normals[0], normals[1]), weight, reflectance)


def _in_tile(tree: Tree, texel: tuple[Value, Value], layout: SampleSetLayout, tile: Value | None) -> Value:
    """The place in the picture of a texel of tile 0 in another tile; None is tile 1, the only other one."""
    x, y = texel
    if tile is None:
        return tree.vector(x, y + 1 / layout.rows, 0.0)
    if layout.columns == 1:
        return tree.vector(x, tile.times_plus(1 / layout.rows, y), 0.0)
    row = tree.math("FLOOR", tile.times_plus(1 / layout.columns, 0.25 / layout.columns))
    column = tile - row * float(layout.columns)
    return tree.vector(column.times_plus(1 / layout.columns, x), row.times_plus(1 / layout.rows, y), 0.0)


def wavelengths_image(illuminant: str, reference_m: float) -> bpy.types.Image:
    """The file's picture of random wavelengths and normal numbers; created if needed.

    Columns are wavelengths over a reference, in red, at equal steps of probability. Rows have two standard normal
    numbers, in green and blue, which differ in each texel."""
    held = f"{illuminant} and normals"
    for image in bpy.data.images:
        if stored.text(image, _ILLUMINANT) == held and image.library is None and not fault_of(image):
            return image
    image = bpy.data.images.new(
        f"Wavelengths {illuminant:.40}", _WAVELENGTHS, _NORMALS, float_buffer=True, is_data=True
    )
    pixels = np.ones((_NORMALS, _WAVELENGTHS, 4), np.float32)
    pixels[..., 0] = wavelength_quantiles(_WAVELENGTHS, illuminant) / reference_m
    pixels[..., 1:3] = _even_normals(_WAVELENGTHS * _NORMALS).reshape(_WAVELENGTHS, _NORMALS, 2).swapaxes(0, 1)
    image.pixels.foreach_set(pixels.ravel())
    image[_ILLUMINANT] = held
    image.pack()
    note_content(image, f"wavelengths {held}")
    return image


def _even_normals(count: int) -> np.ndarray:
    """Pairs (count, 2) of independent standard normal numbers, from Sobol's sequence: any 2^n successive pairs, from a
    multiple of 2^n on, are evenly distributed."""
    from ....precompute.bake.sample_draws import sobol_points  # only a new grating needs them

    normal = NormalDist()
    return np.array([normal.inv_cdf(share) for share in sobol_points(count).flat]).reshape(count, 2)


def reflectance_image(matter: Matter, illuminant: str) -> bpy.types.Image:
    """The file's picture of a matter's reflectance; created if needed.

    Columns are wavelengths at equal steps of probability, as in wavelengths_image. Rows are cosines from 0 to 1."""
    content = f"reflectance {matter} {illuminant}"
    if (present := picture_of(content)) is not None:
        return present
    cosines = (np.arange(_ROWS) + 0.5) / _ROWS
    reflectance = matter.reflectance(wavelength_quantiles(_COLUMNS, illuminant), cosines).T
    image = bpy.data.images.new("Reflectance", _COLUMNS, _ROWS, float_buffer=True, is_data=True)
    pixels = np.ones((_ROWS, _COLUMNS, 4), np.float32)
    pixels[..., :3] = reflectance[..., None]
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    note_content(image, content)
    return image


def _parts(tree: Tree, colour: Value) -> tuple[Value, Value, Value]:
    """The three numbers of a colour."""
    node = tree.node("ShaderNodeSeparateXYZ", colour)
    red, green, blue = (tree.value(node.outputs[axis]) for axis in "XYZ")
    return red, green, blue


def _look_up(tree: Tree, image: bpy.types.Image, at: Value, *, label: str) -> tuple[Value, Value]:
    """Colour and alpha of the texel nearest to a place. These texels have no meaning in between."""
    settings = {"image": image, "interpolation": "Closest", "extension": "EXTEND"}
    node = tree.node("ShaderNodeTexImage", at, label=label, **settings)
    return tree.value(node.outputs["Color"]), tree.value(node.outputs["Alpha"])
