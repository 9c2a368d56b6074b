# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing a random texel of a sample set and a random wavelength in each shading sample.

The White Noise node turns the shaded position into random numbers. Positions differ, so each sample is a new draw."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import bpy

from ....precompute.colour.drawn_wavelengths import wavelength_quantiles
from ....precompute.table.sample_set import SampleSetLayout
from ...blender import stored
from ...nodes.builder import Tree, Value
from ..pictures import fault_of, note_content

_WAVELENGTHS = 512
# Custom property of the picture of wavelengths: its illuminant.
_ILLUMINANT = "ng_wavelengths"


@dataclass(frozen=True)
class Draw:
    """A random draw.

    uv          the frequency q times the sample set's wavelength, a vector
    wavelength  over the sample set's wavelength
    normal      two independent standard normal numbers, a vector
    weight      W / wavelength^2 of the frequency, as a function of s times the sample set's wavelength"""

    uv: Value
    wavelength: Value
    normal: Value
    weight: Callable[[Value], Value]


@dataclass(frozen=True)
class SampleSetNodes:
    """A sample set for nodes: its picture, the picture's layout, and the picture of wavelengths."""

    image: bpy.types.Image
    layout: SampleSetLayout
    wavelengths: bpy.types.Image

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

        return Draw(uv, wavelength, _normal(tree, place), weight)


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


def _normal(tree: Tree, place: Value) -> Value:
    """Two standard normal numbers, by the Box-Muller transform."""
    noise = tree.node("ShaderNodeTexWhiteNoise", place, 1.0, noise_dimensions="4D")
    numbers = tree.node("ShaderNodeSeparateColor", tree.value(noise.outputs["Color"]))
    share, turn = (tree.value(numbers.outputs[name]) for name in ("Red", "Green"))
    angle = turn * (2 * math.pi)
    radius = tree.sqrt(tree.math("LOGARITHM", 1.0 - share * (1 - 2**-24), math.e) * -2.0)
    return tree.vector(radius * tree.math("COSINE", angle), radius * tree.math("SINE", angle), 0.0)


def _look_up(tree: Tree, image: bpy.types.Image, at: Value, *, label: str) -> tuple[Value, Value]:
    """Colour and alpha of the nearest texel. Interpolated texels would have no meaning."""
    settings = {"image": image, "interpolation": "Closest", "extension": "EXTEND"}
    node = tree.node("ShaderNodeTexImage", at, label=label, **settings)
    return tree.value(node.outputs["Color"]), tree.value(node.outputs["Alpha"])
