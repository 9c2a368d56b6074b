# SPDX-License-Identifier: GPL-3.0-or-later
"""The footprint of a pixel: how far the normal turns within it, and the roughness that stands for this.

A pixel shows the mean over the part of the surface within it. On a curved surface the normal turns there, and with it
the order that is seen; a sample at the pixel's middle takes one colour of many. The table's wider levels hold the mean
of all: within a pixel the normals have a variance along an axis of

    F^2 = k p^2 (sum over x, y, z of |a_i|^2) / 2,     a_i = g_i - N (g_i.wr) / (N.wr),     g_i = grad N_i

with p the width of a pixel at the surface and k the variance of what a sample stands for, in pixels: that of the
pixel's filter over the number of samples, since n samples share the filter's area between them. So with more samples
the blur goes, and the mean of all stays what it is without. EEVEE takes its samples at the same places in each frame,
which shows as flicker; there k is that of a quarter of the samples, from the sixteenth on, and of four before it.

A normal that turns by a moves the half vector's tangential part by w a, as a facet of a rough surface does. So the
footprint is a roughness: Beckmann's slopes have a variance of r^4 / 2, and

    r'^4 = r^4 + 2 F^2

The gradients come from Bump nodes: of a height f, a Bump node of distance p turns N to N - p grad f. In Cycles the
normal of the Texture Coordinate node has a gradient and that of the Geometry node has none; in EEVEE it is the other
way round. So their sum has the gradient once in each, and a factor of one of them holds for one engine.

The blur is round, but the normals of a needle turn one way alone: a wide round blur would bring light that no normal
sends. So F^2 is at most (4 degrees)^2, and what turns further within a pixel keeps some noise.

Not in it are the turn of the tangent about the normal, and that of the view, which is less than a pixel's angle.
"""

from ..lamps.driven_nodes import drive_by_scene
from ..nodes.builder import Tree, Value

# The variance, in pixels squared, of the filter of Blackman and Harris with a width of one pixel, which ends one pixel
# from its middle.
_FILTER = 0.0768
# In EEVEE, the most samples that count each, and the share of them that counts where there are many.
_EEVEE_FEW, _EEVEE_SHARE = 4, 4
# The greatest variance of the normals, in rad2. Of a needle a tenth of a pixel wide, the light is 4.1 times too much
# without this limit, and 1.1 times with it; a snake's picture of 16 samples has the same error with it and without
# (laboratory/benchmarks/hard_scenes.py, laboratory/benchmarks/footprint.py).
MOST = 0.005
# The width of a pixel over its distance, and the width of a pixel where it is one everywhere: of the scene's camera.
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
    """Add the nodes of the footprint to a tree; the roughness with it."""
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
    heights = tree.node("ShaderNodeSeparateXYZ", tree.value(turned.outputs["Vector"]) * in_cycles + n * in_eevee)
    cosine = tree.maximum(tree.dot(n, wr), 0.05)
    total: Value | float = 0.0
    for height in heights.outputs:
        bump = tree.node("ShaderNodeBump")
        tree.feed(bump.inputs["Strength"], 1.0)
        tree.feed(bump.inputs["Distance"], p)
        tree.feed(bump.inputs["Height"], tree.value(height))
        bent = tree.value(bump.outputs["Normal"])
        step = bent / tree.dot(bent, n) - n  # - p grad N_i
        total = tree.dot(step, step) + tree.squared(tree.dot(step, wr) / cosine) + total
    # r'^2 = sqrt(r^4 + 2 F^2)
    square = tree.squared(roughness * roughness) + tree.minimum(total * _FILTER, 2 * MOST)
    return tree.sqrt(tree.sqrt(square))
