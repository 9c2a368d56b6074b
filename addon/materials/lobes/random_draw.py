# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing a random texel of a sample set and a random wavelength in each shading sample.

The White Noise node turns the shaded position into random numbers. Positions differ, so each sample is a new draw."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from ....precompute.colour.drawn_wavelengths import wavelength_quantiles
from ....precompute.reflectance.matter import Matter
from ....precompute.table.sample_set import SampleSetLayout
from ...blender import stored
from ...nodes.builder import Tree, Value
from ..pictures import fault_of, note_content, picture_of

_WAVELENGTHS = 512
# Columns (wavelengths) and rows (cosines) of a picture of a reflectance.
_COLUMNS, _ROWS = 256, 512
# Custom property of the picture of wavelengths: its illuminant.
_ILLUMINANT = "ng_wavelengths"


@dataclass(frozen=True)
class Draw:
    """A random draw.

    uv          the frequency q times the sample set's wavelength, a vector
    wavelength  over the sample set's wavelength
    normal      two independent standard normal numbers, a vector
    weight      W / wavelength^2 of the frequency, as a function of s times the sample set's wavelength
    reflectance the matter's reflectance at the drawn wavelength, as a function of the half angle's cosine; 1 without
                a picture of it"""

    uv: Value
    wavelength: Value
    normal: Value
    weight: Callable[[Value], Value]
    reflectance: Callable[[Value], Value | float]


@dataclass(frozen=True)
class SampleSetNodes:
    """A sample set for nodes: its picture, the picture's layout, the picture of wavelengths, and the picture of the
    reflectance if the table holds its matter's."""

    image: bpy.types.Image
    layout: SampleSetLayout
    wavelengths: bpy.types.Image
    reflectance: bpy.types.Image | None = None

    def add_to(self, tree: Tree, place: Value) -> Draw:
        """Add nodes that draw at random by the shaded position."""
        layout = self.layout
        noise = tree.node("ShaderNodeTexWhiteNoise", place, noise_dimensions="3D")
        numbers = tree.node("ShaderNodeSeparateColor", tree.value(noise.outputs["Color"]))
        x, y, share = (tree.value(numbers.outputs[name]) for name in ("Red", "Green", "Blue"))
        wavelength, _ = _look_up(tree, self.wavelengths, tree.vector(share, 0.5, 0.0), label="Wavelength")
        wavelength = tree.dot(wavelength, (1.0, 0.0, 0.0))
        texel = tree.vector(x, y, 0.0) * (1.0 / layout.columns, 1.0 / layout.rows, 0.0)
        rounded, alpha = _look_up(tree, self.image, texel, label="q")
        parts = tree.node("ShaderNodeSeparateXYZ", rounded)
        red, green, blue = (tree.value(parts.outputs[axis]) for axis in "XYZ")
        uv = tree.vector(red + blue, green + alpha, 0.0)

        def weight(s: Value) -> Value:
            along = s * (layout.pieces / layout.s_last)
            piece = tree.minimum(tree.math("FLOOR", along), layout.pieces - 1.0)
            t = (along - piece).times_plus(2.0, -1.0)
            tile = piece + 1.0
            if layout.columns == 1:
                offset = tree.vector(0.0, tile * (1 / layout.rows), 0.0)
            else:
                row = tree.math("FLOOR", tile * (1 / layout.columns) + 0.25 / layout.columns)
                column = tile - row * float(layout.columns)
                offset = tree.vector(column * (1 / layout.columns), row * (1 / layout.rows), 0.0)
            low, cubic = _look_up(tree, self.image, texel + offset, label="W")
            squared = t * t
            powers = tree.vector(1.0, t, squared)
            return (tree.dot(low, powers) + cubic * squared * t) * layout.scale

        def reflectance(cosine: Value) -> Value | float:
            if self.reflectance is None:
                return 1.0
            found = tree.image(self.reflectance, tree.vector(share, cosine, 0.0), "Reflectance")
            return tree.dot(found, (1.0, 0.0, 0.0))

        return Draw(uv, wavelength, _normal(tree, place), weight, reflectance)


def wavelengths_image(illuminant: str, reference_m: float) -> bpy.types.Image:
    """The file's picture of wavelengths over a reference, at equal steps of probability; created if needed."""
    for image in bpy.data.images:
        if stored.text(image, _ILLUMINANT) == illuminant and image.library is None and not fault_of(image):
            return image
    ratios = wavelength_quantiles(_WAVELENGTHS, illuminant) / reference_m
    image = bpy.data.images.new(f"Wavelengths {illuminant}", _WAVELENGTHS, 1, float_buffer=True, is_data=True)
    image.pixels.foreach_set([float(v) for ratio in ratios for v in (ratio, ratio, ratio, 1.0)])
    image[_ILLUMINANT] = illuminant
    image.pack()
    note_content(image, f"wavelengths {illuminant}")
    return image


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


def _normal(tree: Tree, place: Value) -> Value:
    """Two standard normal numbers, by the Box-Muller transform."""
    noise = tree.node("ShaderNodeTexWhiteNoise", place, 1.0, noise_dimensions="4D")
    numbers = tree.node("ShaderNodeSeparateColor", tree.value(noise.outputs["Color"]))
    share, turn = (tree.value(numbers.outputs[name]) for name in ("Red", "Green"))
    angle = turn * (2 * math.pi)
    radius = tree.sqrt(tree.math("LOGARITHM", 1.0 - share * (1 - 2**-24), math.e) * -2.0)
    return tree.vector(radius * tree.math("COSINE", angle), radius * tree.math("SINE", angle), 0.0)


def _look_up(tree: Tree, image: bpy.types.Image, at: Value, *, label: str) -> tuple[Value, Value]:
    """Colour and alpha of the texel nearest to a place. These texels have no meaning in between."""
    settings = {"image": image, "interpolation": "Closest", "extension": "EXTEND"}
    node = tree.node("ShaderNodeTexImage", at, label=label, **settings)
    return tree.value(node.outputs["Color"]), tree.value(node.outputs["Alpha"])
