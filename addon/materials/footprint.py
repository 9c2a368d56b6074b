# SPDX-License-Identifier: GPL-3.0-or-later
"""The footprint of a pixel: how much the normal varies within it, converted to a roughness.

A pixel shows the mean over the part of the surface within it. On a curved surface the normal varies there, and with it
the visible order; a single sample shows only one of the colours. The coarser blur levels of the table hold their mean.
Within a pixel, the normals have the variance along one axis

    F^2 = k p^2 (sum over x, y, z of |a_i|^2) / 2,     a_i = g_i - N (g_i.wr) / (N.wr),     g_i = grad N_i

p is the width of a pixel at the surface. k is the variance of the area that one sample covers, in pixels squared: the
variance of the pixel filter over the number of samples, because n samples share the filter's area. So the blur shrinks
as samples accumulate, and the mean of the pixel does not change. EEVEE places its samples identically in each frame,
which shows as flicker. There k assumes a quarter of the samples, but at least four (or all, if there are fewer).

A normal that turns by a moves the tangential part of the half vector by w a, like a facet of a rough surface. So the
footprint acts as roughness: Beckmann's slopes have the variance r^4 / 2, and

    r'^4 = r^4 + 2 F^2

The gradients come from Bump nodes: for a height f and a distance p, a Bump node turns N to N - p grad f. In Cycles the
normal of the Texture Coordinate node has a gradient and the normal of the Geometry node has none; in EEVEE it is the
other way round. So their sum has the gradient once in each engine, and a factor on one of them applies to one engine.

The blur is round, but the normals of a needle vary along one direction only. A wide round blur would show light that no
normal reflects. So F^2 is at most (4 degrees)^2, and stronger variation within a pixel keeps some noise.

Neglected: the turn of the tangent about the normal, and the turn of the view, which is smaller than a pixel's angle."""

from ..lamps.driven_nodes import drive_by_scene
from ..nodes.builder import Tree, Value

# The variance, in pixels squared, of a Blackman-Harris filter one pixel wide, which ends one pixel from its centre.
_FILTER = 0.0768
# In EEVEE, up to this many samples each count; of many samples, one in this many counts.
_EEVEE_FEW, _EEVEE_SHARE = 4, 4
# The largest variance of the normals, in rad2. A needle a tenth of a pixel wide would be 4.1 times too bright without
# this limit, and is 1.1 times too bright with it. A snake rendered with 16 samples has the same error either way
# (laboratory/benchmarks/hard_scenes.py, laboratory/benchmarks/footprint.py).
MOST = 0.005
# The width of a pixel for the scene's camera: per distance for a perspective camera, constant for an orthographic one.
_PIXELS = "(max(width, height) * percent / 100)"
_PERSPECTIVE = f"(kind == 0) * 2 * tan(angle / 2) / {_PIXELS}"
_ORTHOGRAPHIC = f"(kind == 1) * scale / {_PIXELS}"
_CAMERA = {
    "kind": "camera.data.type",
    "width": "render.resolution_x",
    "height": "render.resolution_y",
    "percent": "render.resolution_percentage",
}


def with_footprint(tree: Tree, roughness: Value) -> Value:
    """Add the footprint's nodes and return the roughness that includes it."""
    per_distance = drive_by_scene(tree, _PERSPECTIVE, _CAMERA | {"angle": "camera.data.angle"}, label="Pixel Angle")
    width = drive_by_scene(tree, _ORTHOGRAPHIC, _CAMERA | {"scale": "camera.data.ortho_scale"}, label="Pixel Width")
    in_cycles = drive_by_scene(
        tree, "width / sqrt(max(n, 1))", {"width": "cycles.filter_width", "n": "cycles.samples"}, label="In Cycles"
    )
    in_eevee = drive_by_scene(
        tree,
        f"width / sqrt(max(n / {_EEVEE_SHARE}, min(max(n, 1), {_EEVEE_FEW})))",
        {"width": "render.filter_size", "n": "eevee.taa_render_samples"},
        label="In EEVEE",
    )
    distance = tree.value(tree.node("ShaderNodeCameraData").outputs["View Distance"])
    p = distance.times_plus(per_distance, width)

    geometry = tree.node("ShaderNodeNewGeometry")
    n, wr = (tree.value(geometry.outputs[name]) for name in ("Normal", "Incoming"))
    coordinates = tree.node("ShaderNodeTexCoord")
    settings = {"vector_type": "NORMAL", "convert_from": "OBJECT", "convert_to": "WORLD"}
    turned = tree.node("ShaderNodeVectorTransform", tree.value(coordinates.outputs["Normal"]), **settings)
    heights = (tree.node("ShaderNodeSeparateXYZ", each).outputs for each in (tree.value(turned.outputs["Vector"]), n))
    cosine = tree.dot(n, wr)
    steep = 1.0 / tree.maximum(cosine, 0.05)
    total: Value | float = 0.0
    for turned_i, n_i in zip(*heights, strict=True):
        bump = tree.node("ShaderNodeBump")
        tree.feed(bump.inputs["Strength"], 1.0)
        tree.feed(bump.inputs["Distance"], p)
        # Cycles computes the height three times for each Bump node, so its few nodes are of numbers.
        tree.feed(bump.inputs["Height"], tree.value(turned_i).times_plus(in_cycles, tree.value(n_i) * in_eevee))
        bent = tree.value(bump.outputs["Normal"])
        # bent is along n - p grad N_i, so 1 / (bent.n)^2 is 1 + |p grad N_i|^2.
        along = 1.0 / tree.dot(bent, n)
        towards = (tree.dot(bent, wr) * along - cosine) * steep
        total = towards.times_plus(towards, along.times_plus(along, -1.0)) + total
    # r'^2 = sqrt(r^4 + 2 F^2)
    square = tree.squared(roughness * roughness) + tree.minimum(tree.maximum(total, 0.0) * _FILTER, 2 * MOST)
    return tree.sqrt(tree.sqrt(square))
