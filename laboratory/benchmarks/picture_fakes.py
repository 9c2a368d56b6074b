# SPDX-License-Identifier: GPL-3.0-or-later
"""Two fakes that artists use instead of a measured surface, beside which picture.py renders the add-on's materials.

Three lobes are glossy closures in red, green and blue, as made by hand in Redshift. Each normal is tilted along T by
half of lambda / d, so that the closure mirrors its colour's first order. They are anisotropic, as the orders of a line
grating lie in one plane. The rainbow is that of GPU Gems, chapter 8 (Stam 2004): orders of u d, each a rainbow of three
bumps, and a highlight. Neither has an absolute brightness."""

from types import SimpleNamespace
from typing import Any

from precompute.methods.gem import ORDERS
from precompute.optics.brdf import KERATIN_IOR

_LOBES_NM = {(1, 0, 0): 610, (0, 1, 0): 545, (0, 0, 1): 465}
_ROUGHNESS, _ANISOTROPY = 0.25, 0.7
_SHARPNESS, _HIGHLIGHT = 4.0, 20.0  # sharpness of the rainbow's bumps and of its highlight


def lobes(tree: Any, period_m: float, gain: Any = 1.0) -> Any:
    """Add three tilted glossy closures to a tree, multiplied by a gain."""
    n = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Normal"])
    t = tree.value(tree.node("ShaderNodeTangent", direction_type="UV_MAP").outputs[0])
    reflectance = tree.fresnel(KERATIN_IOR, n) * gain
    shader = None
    for colour, nanometres in _LOBES_NM.items():
        normal = tree.normalize(t.times_plus((nanometres * 1e-9 / period_m / 2,) * 3, n))
        node = tree.node("ShaderNodeBsdfAnisotropic", reflectance * tuple(map(float, colour)), _ROUGHNESS, _ANISOTROPY)
        tree.feed(node.inputs["Normal"], normal)
        tree.feed(node.inputs["Tangent"], t)
        shader = tree.add_shader(shader, tree.value(node.outputs[0]))
    return shader


def rainbow_response(addon: SimpleNamespace, period_m: float) -> Any:
    """A surface's response to one lamp by GPU Gems' rainbow."""
    import bpy

    socket = addon.response
    group = bpy.data.node_groups.new("Rainbow", "ShaderNodeTree")
    asked = socket.NORMAL, socket.TANGENT, socket.TO_LIGHT, socket.IRRADIANCE
    addon.interface.add_interface(group, asked, socket.ONE_RADIANCE)
    tree = addon.builder.Tree(group)
    n, t, wi, irradiance = tree.inputs().values()
    half = wi + tree.value(tree.node("ShaderNodeNewGeometry").outputs["Incoming"])
    u, w = tree.dot(half, t), tree.maximum(tree.dot(half, n), 1e-6)
    path_um = tree.math("ABSOLUTE", u) * (period_m * 1e6)
    off = tree.math("DIVIDE", u, w) * _HIGHLIGHT
    shown = tree.math("EXPONENT", off * off * -1.0)
    for order in range(1, ORDERS + 1):
        y = path_um.times_plus(2 / order, -1.0)
        x = (y - (0.75, 0.5, 0.25)) * _SHARPNESS
        shown = tree.vector_math("MAXIMUM", 1.0 - x * x, (0.0, 0.0, 0.0)) + shown
    tree.output(irradiance * shown)
    return socket.Response(group)
