# SPDX-License-Identifier: GPL-3.0-or-later
"""The Direct node group: one sun, no noise.

| socket    | symbol | unit    | default | meaning |
|-----------|--------|---------|---------|---------|
| Normal    | N      |         |         | shading normal |
| Tangent   | T      |         |         | direction of the scan's columns on the surface |
| Strength  |        |         | 1       | scales the diffraction; 1 is physical |
| IOR       | n      |         | 1.56    | of the skin: sets how much is reflected at all |
| Rotation  |        | radians | 0       | turns the grating about the normal, from T towards B |
| Energy Conserving | e |  | 1       | 0 is Stam's form, which outshines its light towards grazing |
| Radiance (out) | Lo | W/m2/sr |         | linear RGB of the scene |

    Lo = E R / M [ (1 + wi.wr)^2 / cos(tr) * sum_k T_k(w - 1) B_k(u, v) + cos(ti) Z(w) kernel(u, v) ]

    M = 1 + e max(X(wi) / cos(ti), X(wr) / cos(tr))

which is f * E * cos(ti) with Stam's obliquity, the w^2 of which cancels that of the table (DESIGN 2), over the limit M
that keeps it from reflecting more than it receives: X is the excess albedo, E in precompute/albedo.py.
"""

import math

import bpy

from ...precompute.atlas import STRIP_ROWS, Layout
from ...precompute.brdf import KERATIN_IOR
from .. import key_light
from .builder import Tree, Value

GROUP_PREFIX = "Diffraction Direct"


def build_direct_group(name: str, image: bpy.types.Image, layout: Layout, rgb_from_xyz) -> bpy.types.NodeTree:
    """Node group of one bake; image holds its atlas, rgb_from_xyz (3, 3) leads to the scene's linear space."""
    group = bpy.data.node_groups.new(f"{GROUP_PREFIX} {name}", "ShaderNodeTree")
    tree = Tree(group)
    inputs = _interface(group)
    normal, tangent, strength, ior, rotation, conserving = (tree.value(socket) for socket in inputs)

    n = tree.normalize(normal)
    t, b = _frame(tree, n, tangent, rotation)
    wi = tree.normalize(tree.attribute(key_light.direction_name(0)))
    wr = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Incoming"])
    half = wi + wr
    u, v, w = tree.dot(half, t), tree.dot(half, b), tree.dot(half, n)
    cos_i, cos_r = tree.dot(wi, n), tree.dot(wr, n)
    wi_wr = tree.dot(wi, wr)
    u_i, v_i = tree.dot(wi, t), tree.dot(wi, b)

    xyz = _scattered(tree, image, layout, u, v, w) * (tree.squared(wi_wr + 1.0) / tree.maximum(cos_r, 1e-6))
    xyz = xyz + _zero_order(tree, image, layout, u, v, w) * cos_i
    rgb = _matrix(tree, rgb_from_xyz, xyz)

    lit = tree.math("GREATER_THAN", cos_i, 0.0) * tree.math("GREATER_THAN", cos_r, 0.0)
    excess_i = _excess_albedo(tree, image, layout, u_i, v_i, cos_i)
    excess_r = _excess_albedo(tree, image, layout, u - u_i, v - v_i, cos_r)
    limit = tree.maximum(excess_i, excess_r).times_plus(conserving, 1.0)
    gain = _fresnel(tree, wi_wr, ior) * lit * strength * layout.scale / limit
    radiance = rgb * gain * tree.attribute(key_light.irradiance_name(0))
    # Out-of-gamut spectral colours have a negative component, which no renderer carries through.
    radiance = tree.vector_math("MAXIMUM", radiance, (0.0, 0.0, 0.0))
    output = tree.node("NodeGroupOutput")
    tree.feed(output.inputs[0], radiance)
    return group


def _interface(group: bpy.types.NodeTree) -> list[bpy.types.NodeSocket]:
    sockets = group.interface
    for name, kind, default, text in (
        ("Normal", "NodeSocketVector", None, "Shading normal"),
        ("Tangent", "NodeSocketVector", None, "Direction of the scan's columns on the surface"),
        ("Strength", "NodeSocketFloat", 1.0, "Scales the diffraction; 1 is physical"),
        ("IOR", "NodeSocketFloat", KERATIN_IOR, "Index of refraction: 1.56 is keratin, 2.5 and above metal-like"),
        ("Rotation", "NodeSocketFloat", 0.0, "Turns the grating about the normal"),
        ("Energy Conserving", "NodeSocketFloat", 1.0, "Keeps the reflected light under the received; 0 is Stam's form"),
    ):
        socket = sockets.new_socket(name, in_out="INPUT", socket_type=kind, description=text)
        if default is None:
            socket.hide_value = True
        else:
            socket.default_value = default
    for item in sockets.items_tree:
        if item.name == "Strength":
            item.min_value, item.max_value = 0.0, 1000.0
        elif item.name == "IOR":
            item.min_value, item.max_value = 1.0, 10.0
        elif item.name == "Rotation":
            item.subtype = "ANGLE"
        elif item.name == "Energy Conserving":
            item.min_value, item.max_value = 0.0, 1.0
            item.subtype = "FACTOR"
    sockets.new_socket("Radiance", in_out="OUTPUT", socket_type="NodeSocketColor", description="Diffracted light")
    return list(Tree(group).node("NodeGroupInput").outputs)[:6]


def _frame(tree: Tree, n: Value, tangent: Value, rotation: Value) -> tuple[Value, Value]:
    """T and B about n: the tangent made orthogonal, then turned."""
    t = tree.normalize(tangent - n * tree.dot(n, tangent))
    b = tree.cross(n, t)
    cosine, sine = tree.math("COSINE", rotation), tree.math("SINE", rotation)
    turned = t * cosine + b * sine
    return turned, tree.cross(n, turned)


def _scattered(tree: Tree, image, layout: Layout, u: Value, v: Value, w: Value) -> Value:
    """sum_k T_k(t) B_k(u, v): XYZ over w^2, one look-up a term; t goes from -1 to 1 over the range of w."""
    width, height = layout.width, layout.height
    to_image = (1 / (layout.texel * width), 1 / (layout.texel * height), 0.0)
    first = (0.5 - layout.u_first / layout.texel) / width, (0.5 - layout.v_first / layout.texel) / height, 0.0
    half_range = (layout.w_max - layout.w_min) / 2
    place = tree.vector(u, v, 0.0)
    t = w.times_plus(1 / half_range, -(layout.w_min + layout.w_max) / 2 / half_range)
    if not layout.whole:  # its rim stands for what lies outside: beside it are other tiles, and polynomials run away
        last = tuple(
            start + (count - 1) * layout.texel
            for start, count in ((layout.u_first, layout.tile_columns), (layout.v_first, layout.tile_rows))
        )
        place = tree.vector_math("MAXIMUM", place, (layout.u_first, layout.v_first, 0.0))
        place = tree.vector_math("MINIMUM", place, (*last, 0.0))
        t = tree.maximum(tree.math("MINIMUM", t, 1.0), -1.0)
    place = place.times_plus(to_image, first)
    polynomials = [None, t]
    total = None
    for k in range(layout.terms):
        x, y = layout.tile_origin(k)
        term = tree.image(image, place + (x / width, y / height, 0.0), label=f"B{k}")
        if k >= 2:
            polynomials.append((t * 2.0).times_plus(polynomials[-1], polynomials[-2] * -1.0 if k > 2 else -1.0))
        total = term if total is None else term.times_plus(polynomials[k], total)
    return total


def _zero_order(tree: Tree, image, layout: Layout, u: Value, v: Value, w: Value) -> Value:
    """Z(w) kernel(u, v) in XYZ: the mirror's share."""
    step = (layout.zero_order_samples - 1) / 2
    x = w.times_plus(step / layout.width, 0.5 / layout.width)
    z = tree.image(image, tree.vector(x, STRIP_ROWS / 2 / layout.height, 0.0), label="Z")
    variance = layout.sigma_b**2
    radius2 = (u * u) + (v * v)
    return z * (tree.math("EXPONENT", radius2 * (-0.5 / variance)) * (1 / (2 * math.pi * variance)))


def _excess_albedo(tree: Tree, image, layout: Layout, x: Value, y: Value, cosine: Value) -> Value:
    """X / cos(t) of the direction (x, y, cosine): columns by azimuth, rows by sqrt(cos(t)) (precompute/albedo.py)."""
    columns, rows = layout.limit_columns - 1, layout.limit_rows - 1
    azimuth = tree.math("ARCTAN2", y, x)
    column = azimuth.times_plus(columns / (2 * math.pi) / layout.width, (columns / 2 + 0.5) / layout.width)
    root = tree.sqrt(tree.maximum(cosine, 0.0))
    row = root.times_plus(rows / layout.height, (STRIP_ROWS + 0.5) / layout.height)
    excess = tree.image(image, tree.vector(column, row, 0.0), label="X")
    return tree.dot(excess, (1.0, 0.0, 0.0)) / tree.maximum(cosine, 1e-6)


def _fresnel(tree: Tree, wi_wr: Value, ior: Value) -> Value:
    """Unpolarised reflectance of a dielectric at the half angle (precompute/brdf.py)."""
    c = tree.sqrt(tree.maximum((wi_wr + 1.0) * 0.5, 0.0))
    n2 = ior * ior
    g = tree.sqrt(n2 - 1.0 + c * c)
    perpendicular = (c - g) / (c + g)
    parallel = (n2 * c - g) / (n2 * c + g)
    return (perpendicular * perpendicular + parallel * parallel) * 0.5


def _matrix(tree: Tree, matrix, vector: Value) -> Value:
    rows = [tree.dot(vector, tuple(float(m) for m in row)) for row in matrix]
    return tree.vector(*rows)
