# SPDX-License-Identifier: GPL-3.0-or-later
"""The World node group: glossy closures for light from unknown directions on a baked surface.

| socket            | symbol | default | meaning |
|-------------------|--------|---------|---------|
| Normal, Tangent   | N, T   |         | as in the Direct group (direct/direct_group.py), as are the settings |
| Mirror (out)      |        |         | colour of a closure around N: the zero order |
| Mirror Roughness (out) |   |         | of that closure |
| Lobe (out)        |        |         | colour of a closure around Lobe Normal: one order of the scattered light |
| Lobe Normal (out) |        |         | (wi + wr) / 2; closures use its direction only |
| Lobe Roughness (out) |     |         | of that closure |
| Lobe Direction (out) | wi  |         | the direction that the order comes from, unit |

A glossy closure reflects its colour at any roughness and any tilt of its normal. So the mean over many draws is the
scattered light, if each draw has the colour

    C = D c^2 G W(q; c w / lambda) / lambda^2 rgb(u, v, w) / (X + Y + Z)(u, v, w)

G is 4 cos(ti) cos(tr) Q. For a table that holds its matter's reflectance, Q is multiplied by R / F: R is the matter's
reflectance at the drawn wavelength and the half angle, F Fresnel's at the layout's ratio_ior, as is Q. The
table's colour below has no brightness, so the table's own R does not count.
The frequency q is drawn from the sample set (precompute/table/sample_set.py), which also gives its weight W. The
wavelength lambda is drawn in proportion to the observer's X + Y + Z, whose integral is D
(precompute/colour/observer.py). They determine the direction wi: its tangential part is lambda q / p minus the
view's. The colour of a single wavelength would be out of gamut and different in each draw. So a draw shows the table's
colour in its direction, the mean over all wavelengths from there. The other symbols are defined in
direct/direct_group.py.

Under a plate, C has the directions inside, and is multiplied by what leaves the plate, g(wi) g(wr)
(precompute/table/plate_gains.py). An order that the front face reflects totally is black. The closure is around the
directions above the plate.

The closure of an order combines the width of the coherence kernel, with the standard deviation sigma_b in (u, v), and
the skin's roughness r: alpha^2 = 2 sigma_b^2 / w^2 + r^4. This is exact for a Beckmann lobe. The bins of the spectrum
may already include a part of the kernel (blur_q), which is subtracted here. If Sharp is 1, the kernel moves the
direction at random instead, and the closure is a perfect mirror. The place where the colour is read moves in both
cases, so that the colours of many draws add up correctly. A wide closure cannot tell in which of its directions the
light is, so with it the kernel blurs the colours twice.

The closure of the mirror image (the zero order) is as rough as the skin, so Blender blurs the image by the lamp's disc
and the roughness alone. Its colour is what the zero order reflects along the mirror direction of the viewer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from statistics import NormalDist

import bpy
import numpy as np

from ....precompute.colour.observer import drawn_weight, wavelength_quantiles
from ....precompute.reflectance.matter import Matter
from ....precompute.table.atlas import Layout
from ....precompute.table.sample_set import SampleSetLayout
from ...blender import stored
from ...nodes.builder import Tree, Value
from ...nodes.interface import add_interface, arrange
from ..atlas_nodes import (
    Atlas,
    AtlasTable,
    Direction,
    LampColours,
    dielectric_ior,
    mirror_gain,
    of_layer,
    scattered_gain,
    shown_rgb,
    small_slope_over_fresnel,
    small_slope_reflectance,
    zero_order_at,
)
from ..matter_nodes import FACE_ROUGHNESS, Plate
from ..pictures import fault_of, note_content, picture_of
from ..response import LAYER, SPECTRAL_WORLD_ANSWER, SPECTRUM, WORLD_ANSWER, WORLD_QUESTION

# Columns and rows of the picture of wavelengths and normal numbers.
_WAVELENGTHS, _NORMALS = 512, 16
# Columns (wavelengths) and rows (cosines) of a picture of a reflectance.
_COLUMNS, _ROWS = 256, 512
# Custom property of the picture of wavelengths: what it holds.
_ILLUMINANT = "ng_wavelengths"


@dataclass(frozen=True)
class Draw:
    """A random texel of a sample set and a random wavelength, drawn anew in each shading sample. The White Noise node
    turns the shaded position into three random numbers: two choose the texel, the third chooses the wavelength.

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
    """A sample set for nodes, or several as layers: their picture, the layout of each, the picture of wavelengths and
    normal numbers, and the picture of the reflectance if the table holds its matter's."""

    image: bpy.types.Image
    layouts: tuple[SampleSetLayout, ...]
    wavelengths: bpy.types.Image
    reflectance: bpy.types.Image | None = None

    def add_to(self, tree: Tree, place: Value, layer: Value | None = None) -> Draw:
        """Add nodes that draw at random by the shaded position. `layer` is the number of the sample set among several,
        whose pictures are side by side."""
        layout, count = self.layouts[0], len(self.layouts)
        noise = tree.node("ShaderNodeTexWhiteNoise", place, noise_dimensions="3D")
        x, y, share = _parts(tree, tree.value(noise.outputs["Color"]))
        # The digits of x below the width of a texel, which it chooses, are a further random number.
        further = tree.math("FRACT", x * float(layout.size))
        drawn, _ = _look_up(tree, self.wavelengths, tree.vector(share, further, 0.0), label="Wavelength")
        wavelength, *normals = _parts(tree, drawn)
        # A step to the next tile, and to the next layer.
        across, upward = 1 / (layout.columns * count), 1 / layout.rows
        x, y = x * across if layer is None else x.times_plus(across, layer * (1 / count)), y * upward
        rounded, alpha = _look_up(tree, self.image, tree.vector(x, y, 0.0), label="q")
        red, green, blue = _parts(tree, rounded)

        def weight(s: Value) -> Value:
            pieces = of_layer(layer, [float(each.pieces) for each in self.layouts])
            along = s.times_plus(of_layer(layer, [each.pieces / each.s_last for each in self.layouts]), 1.0)
            tile = None if pieces == 1 else tree.minimum(tree.math("FLOOR", along), pieces)
            t = (along - (1.0 if tile is None else tile)).times_plus(2.0, -1.0)
            at = _in_tile(tree, (x, y), tile, columns=layout.columns, step=(across, upward))
            colour, third = _look_up(tree, self.image, at, label="W")
            zeroth, first, second = _parts(tree, colour)
            return third.times_plus(t, second).times_plus(t, first).times_plus(t, zeroth)

        def reflectance(cosine: Value) -> Value | float:
            if self.reflectance is None:
                return 1.0
            return _parts(tree, tree.image(self.reflectance, tree.vector(share, cosine, 0.0), "Reflectance"))[0]

        return Draw((red + blue, green + alpha), wavelength, (normals[0], normals[1]), weight, reflectance)


def _in_tile(
    tree: Tree, texel: tuple[Value, Value], tile: Value | None, *, columns: int, step: tuple[float, float]
) -> Value:
    """The place in the picture of a texel of tile 0 in another tile; None is tile 1, the only other one. `step`: from a
    tile to the next, across and upward."""
    (x, y), (across, upward) = texel, step
    if tile is None:
        return tree.vector(x, y + upward, 0.0)
    if columns == 1:
        return tree.vector(x, tile.times_plus(upward, y), 0.0)
    row = tree.math("FLOOR", tile.times_plus(1 / columns, 0.25 / columns))
    column = tile - row * float(columns)
    return tree.vector(column.times_plus(across, x), row.times_plus(upward, y), 0.0)


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


@cache
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


# The least cosine of a direction. At or below the horizon, the weight of a lobe is not finite.
COSINE_MIN = 1e-4


@dataclass(frozen=True)
class SeenSurface:
    """A bake in a node tree, and its viewer.

    above         the direction to the viewer, above a plate
    ior           the index of refraction of a dielectric
    height_scale  the factor of the relief's heights"""

    tree: Tree
    atlas: Atlas
    above: Direction
    ior: Value
    height_scale: Value

    @property
    def layout(self) -> Layout:
        """The layout of the bake."""
        return self.atlas.layout

    @property
    def plate(self) -> Plate:
        """The plate over the relief."""
        return Plate(self.layout.plate_ior)

    @cached_property
    def inside(self) -> Direction:
        """The direction to the viewer, inside a plate."""
        return self.plate.inside(self.tree, self.above)

    @cached_property
    def cosine(self) -> Value:
        """The cosine of `inside`, at least COSINE_MIN."""
        return self.tree.maximum(self.inside.cosine, COSINE_MIN)

    @cached_property
    def is_seen(self) -> Value:
        """1 if the viewer is above the surface, else 0."""
        return self.tree.math("GREATER_THAN", self.above.cosine, 0.0)

    @cached_property
    def gain(self) -> Value:
        """What of the scattered light leaves the plate towards the viewer."""
        return scattered_gain(self.tree, self.atlas, way=self.above)

    def scattered_out(self, light: Value, above: Direction) -> Value:
        """Scattered light from a direction, times what of it leaves the plate."""
        if not self.plate.present:
            return light
        gain = scattered_gain(self.tree, self.atlas, way=above)
        return light * self.tree.math("MULTIPLY", gain, self.gain)


def mirror_image(
    surface: SeenSurface, normal: Value, rgb_from_xyz: np.ndarray, *, of_world: LampColours | None = None
) -> list[Value]:
    """The colour of the closure; then the colour `of_world`, if it is given."""
    tree = surface.tree
    triples = surface.layout.triples if of_world is not None else 1
    w = surface.cosine * 2.0 * surface.height_scale
    channels = [zero_order_at(tree, surface.atlas, w=w, triple=triple) for triple in range(triples)]
    share = _reflected(surface, normal)
    if surface.plate.present:
        gains = (mirror_gain(tree, surface.atlas, way=surface.above, triple=triple) for triple in range(triples))
        passed = tree.squared(surface.plate.passed(tree, surface.above, surface.inside))
        channels = [colour.times_plus(passed, gain) for colour, gain in zip(channels, gains, strict=True)]
    colours = [shown_rgb(tree, rgb_from_xyz, channels[0])]
    if of_world is not None:
        colours.append(of_world.shown(channels))
    return [tree.blend(share, 0.0, colour) for colour in colours]


def _reflected(surface: SeenSurface, normal: Value) -> Value:
    """The reflected share without the zero order, along the mirror direction of the viewer; 0 if that is below."""
    if surface.layout.holds_reflectance:
        return surface.is_seen
    return surface.tree.fresnel(surface.ior, normal) * surface.is_seen


GROUP_PREFIX = "Diffraction World"
# The least X + Y + Z of the table relative to its scale, to avoid a division by 0.
_SUM_MIN = 1e-9
# How much larger a component may be, over the world's own, than under daylight: a single hue of blue light under 2000 K
# is brighter beside the little blue of the lamp itself.
_OF_WORLD = 4.0


def build_world_group(
    name: str, image: bpy.types.Image, layout: Layout, *, draws: SampleSetNodes, rgb_from_xyz: np.ndarray,
    lamp_table: bpy.types.Image | None = None,
) -> bpy.types.NodeTree:  # fmt: skip
    """The World group of one bake, or of several as layers, from the atlas and the sample sets. rgb_from_xyz (3, 3)
    gives the scene's RGB. `lamp_table` (atlas_nodes.py) is for a bake with more channels than XYZ."""
    group = bpy.data.node_groups.new(f"{GROUP_PREFIX} {name}", "ShaderNodeTree")
    more = [*([LAYER] if len(draws.layouts) > 1 else []), *([] if lamp_table is None else [SPECTRUM])]
    add_interface(group, (*WORLD_QUESTION, *more), WORLD_ANSWER if lamp_table is None else SPECTRAL_WORLD_ANSWER)
    tree = Tree(group)
    asked = tree.inputs()
    layer = asked.get(LAYER.name)
    atlas = Atlas(image, layout, len(draws.layouts), layer)
    n, t, sharp, roughness, ior, period_scale, height_scale = (asked[each.name] for each in WORLD_QUESTION)
    b = tree.cross(n, t)
    geometry = tree.node("ShaderNodeNewGeometry")
    wr = tree.value(geometry.outputs["Incoming"])
    if not layout.holds_reflectance:
        ior = dielectric_ior(tree, ior)
    surface = SeenSurface(tree, atlas, Direction.seen_in(tree, wr, (t, b, n)), ior, height_scale)
    colours = None
    if lamp_table is not None:
        colours = LampColours(tree, lamp_table, asked[SPECTRUM.name], layout.triples)
    mirrored, *mirrored_of_world = mirror_image(surface, n, rgb_from_xyz, of_world=colours)

    draw = draws.add_to(tree, tree.value(geometry.outputs["Position"]), layer)
    variance = _variance(tree, draw, layout.sigma_b, of_layer(layer, [-(each.blur**2) for each in draws.layouts]))
    deviation = tree.sqrt(variance) if isinstance(variance, Value) else variance**0.5
    moved = [each * deviation for each in draw.normals]
    u, v = (q.times_plus(draw.wavelength, each) for q, each in zip(draw.q, moved, strict=True))
    # A stretched relief has lower frequencies. The tangential part of wi + wr, inside a plate.
    across, along = (
        tree.math("DIVIDE", q.times_plus(draw.wavelength, each * sharp), period_scale)
        for q, each in zip(draw.q, moved, strict=True)
    )
    order = _Order.of(surface, across, along)
    # The constant factors of all draws: D, the weights' scale, and the 4 of G.
    scale = drawn_weight(layout.illuminant) * draws.layouts[0].scale * 4.0
    table = _Looked(surface, scale, uv=(u, v), w=order.w)
    inverse = tree.math("DIVIDE", height_scale, draw.wavelength)
    gain = tree.squared(inverse) * draw.weight(order.w * inverse) * _gain(surface, order, draw)
    gain = tree.maximum(gain, 0.0)
    lobe = tree.blend(gain, 0.0, table.colour(rgb_from_xyz))
    of_world = mirrored_of_world
    if colours is not None:
        of_world = [*mirrored_of_world, tree.blend(gain, 0.0, table.colour_of_world(colours, rgb_from_xyz))]

    alpha2 = tree.math("DIVIDE", variance * (2 * layout.plate_ior**2), tree.squared(order.sum_above[2]))
    alpha2 = tree.minimum(alpha2 + tree.squared(tree.squared(roughness)), 1.0)
    lobe_roughness = tree.sqrt(tree.sqrt(alpha2)) * (1.0 - sharp)
    half_way = order.half_way(surface, (t, b, n))
    to_light = tree.blend(2.0, wr, half_way)
    at_least = tree.maximum(roughness, FACE_ROUGHNESS) if surface.plate.present else roughness
    tree.output(mirrored, at_least, lobe, half_way, lobe_roughness, to_light, *of_world)
    arrange(group)
    return group


@dataclass(frozen=True)
class _Order:
    """A drawn order: the direction that its light comes from.

    inside, above  the direction inside a plate, and above it
    w              the component of wi + wr along the normal, inside
    half2          1 + wi.wr, inside
    sum_above      the components of wi + wr along T, B and N, above
    is_real        1 if there is such a direction and the surface is seen, else 0"""

    inside: Direction
    above: Direction
    w: Value
    half2: Value
    sum_above: tuple[Value, Value, Value]
    is_real: Value

    @classmethod
    def of(cls, surface: SeenSurface, across: Value, along: Value) -> _Order:
        """The order with these components of wi + wr along T and B, inside a plate."""
        tree, plate = surface.tree, surface.plate
        x, y = across - surface.inside.x, along - surface.inside.y
        cosine2 = 1.0 - y.times_plus(y, x * x)
        cosine = tree.sqrt(tree.maximum(cosine2, COSINE_MIN**2))
        w = cosine + surface.cosine
        half2 = w.times_plus(w, across.times_plus(across, along * along)) * 0.5
        inside = above = Direction(x, y, cosine)
        sum_above = across, along, w
        if plate.present:
            cosine2, above, view = plate.cosine2_above(tree, inside), plate.above(tree, inside), surface.above
            sum_above = above.x + view.x, above.y + view.y, above.cosine + view.cosine
        is_real = tree.math("GREATER_THAN", cosine2, COSINE_MIN**2) * surface.is_seen
        return cls(inside, above, w, half2, sum_above, is_real)

    def half_way(self, surface: SeenSurface, frame: tuple[Value, Value, Value]) -> Value:
        """(wi + wr) / 2 in world space above a plate, given the axes (T, B, N)."""
        tree = surface.tree
        x, y, z = self.sum_above
        parts = [tree.blend(each, 0.0, axis) for each, axis in zip((x * 2.0, y * 2.0, z), frame, strict=True)]
        return tree.blend(0.5, tree.blend(0.5, *parts[:2]), parts[2])


def _variance(tree: Tree, draw: Draw, sigma_b: float, held: Value | float) -> Value | float:
    """The variance in (u, v) of the part of the kernel that the sample set lacks at the drawn wavelength. `held` is the
    negative variance of what it has."""
    if held == 0:
        return sigma_b**2
    return tree.maximum(tree.squared(draw.wavelength).times_plus(held, sigma_b**2), 0.0)


class _Looked:
    """The table at a place of an order. Its colours have X + Y + Z = scale under daylight, and are black outside of the
    table."""

    def __init__(self, surface: SeenSurface, scale: float, *, uv: tuple[Value, Value], w: Value):
        self.tree, self.layout, self.scale = surface.tree, surface.layout, scale
        self.table = AtlasTable(self.tree, surface.atlas, uv=uv, w=w * surface.height_scale)
        self.xyz = self.table.read(self.table.sharp)
        total = self.tree.maximum(self.tree.dot(self.xyz, (1.0, 1.0, 1.0)), _SUM_MIN)
        self.share = self.tree.math("DIVIDE", self.table.inside * scale, total)

    def colour(self, rgb_from_xyz: np.ndarray) -> Value:
        """The colour under daylight."""
        return self._limited(shown_rgb(self.tree, rgb_from_xyz, self.xyz), rgb_from_xyz, 1.0)

    def colour_of_world(self, colours: LampColours, rgb_from_xyz: np.ndarray) -> Value:
        """The colour under a world, over that of the world."""
        others = [self.table.read(self.table.sharp, triple) for triple in range(1, self.layout.triples)]
        return self._limited(colours.shown([self.xyz, *others]), rgb_from_xyz, _OF_WORLD)

    def _limited(self, rgb: Value, rgb_from_xyz: np.ndarray, more: float) -> Value:
        """No light has a larger component than the most saturated colour. Rounding errors of the table in the dark
        may."""
        red, green, blue = (float(row.max()) * self.scale * more for row in rgb_from_xyz)
        return self.tree.vector_math("MINIMUM", rgb * self.share, (red, green, blue))


def _gain(surface: SeenSurface, order: _Order, draw: Draw) -> Value:
    """G for a drawn order, without its 4, times what a plate's front face lets through."""
    tree, light, view = surface.tree, order.inside, surface.inside
    if surface.layout.holds_reflectance:
        # |wi + wr| / 2 is the cosine of the half angle.
        matter = draw.reflectance(tree.sqrt(order.half2 * 0.5))
        ratio_ior = surface.layout.ratio_ior
        gain = small_slope_over_fresnel(tree, ratio_ior, light=light, view=view, one_plus=order.half2) * matter
    else:
        gain = small_slope_reflectance(tree, surface.ior, light=light, view=view, one_plus=order.half2)
    return surface.scattered_out(gain * (light.cosine * surface.cosine) * order.is_real, order.above)
