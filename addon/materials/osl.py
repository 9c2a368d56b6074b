# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's algorithms per pixel, in Open Shading Language (Cycles on the CPU): the in-render reference.

| socket         | symbol | unit    | meaning |
|----------------|--------|---------|---------|
| Normal         | N      |         | unit shading normal |
| Tangent        | T      |         | unit, orthogonal to N, along the scan's columns |
| To Light       | wi     |         | unit vector to the light |
| Irradiance     | E      | W/m2    | on a surface that faces the light, linear RGB |
| IOR            | n      |         | of the skin |
| Finer (out)    | Lo     | W/m2/sr | linear RGB of the scene; the name that diffraction.py asks every answer for |

The formula stands at the head of addon/osl/radiance.osl; it is Stam's form. The zero order is not told apart from the
rest and has the rest's obliquity, as in precompute's own comparison of the methods (brdf_map.from_method).

A shader's text is put together from the parts in addon/osl, behind a list of constants, so that a .blend holds all of
it; the images it reads stay a file of their own, at the path that is written into the text: Blender 5.2 wants texture
names that are constants.
"""

from pathlib import Path

import bpy
import numpy as np

from ...precompute.brdf import KERATIN_IOR
from ...precompute.colour import WAVELENGTH_MAX_M, WAVELENGTH_MIN_M, observer, spectral_weights
from ...precompute.dft_images import Layout, read_layout
from ...precompute.failure import GratingError
from ...precompute.methods.nmm import specular_radius
from ...precompute.reference import wavelengths
from .builder import Tree

GROUP_PREFIX = "Diffraction OSL"
_PARTS = Path(__file__).resolve().parents[1] / "osl"
# In um, as the shaders count: wavelengths go through single precision better than in metres.
_UM = 1e6
_OBSERVER_STEP_M = 1e-9


def build_osl_response(name: str, images_path: Path, rgb_from_xyz: np.ndarray) -> bpy.types.NodeTree:
    """Node group that answers to one lamp by the method of a file of images (`precompute dft`); rgb_from_xyz (3, 3)
    leads to the scene's linear space.

    Raises GratingError if the file is none, or if the shader does not compile, as where Cycles has no OSL."""
    layout = read_layout(images_path)
    title = f"{GROUP_PREFIX} {layout.method.upper()} {name}"
    group = bpy.data.node_groups.new(title, "ShaderNodeTree")
    tree = Tree(group)
    inputs = _interface(group)
    script = tree.node("ShaderNodeScript", label=layout.method.upper())
    text = bpy.data.texts.new(f"{title}.osl")
    text.from_string(shader_text(layout, images_path, rgb_from_xyz))
    script.mode = "INTERNAL"
    script.script = text
    if not script.bytecode or len(script.inputs) != len(inputs):
        bpy.data.node_groups.remove(group)
        bpy.data.texts.remove(text)
        raise GratingError(f"{title}: the shader does not compile; choose Cycles as the renderer of a Blender with OSL")
    for socket, value in zip(script.inputs, inputs, strict=True):
        tree.feed(socket, tree.value(value))
    tree.feed(tree.node("NodeGroupOutput").inputs[0], tree.value(script.outputs["Radiance"]))
    return group


def missing_for_osl(scene: bpy.types.Scene) -> str | None:
    """What keeps a scene from running these shaders, as a remedy to show; None where nothing does."""
    if not bpy.app.build_options.cycles_osl:
        return "this Blender is built without Open Shading Language: take one from blender.org"
    if scene.render.engine != "CYCLES":
        return "choose Cycles as the renderer"
    if scene.cycles.device != "CPU":
        return "choose CPU as Cycles' device"
    if not scene.cycles.shading_system:
        return "switch on Cycles' Open Shading Language"
    return None


def shader_text(layout: Layout, images_path: Path, rgb_from_xyz: np.ndarray) -> str:
    """The whole source of a layout's shader."""
    window = "pq" if layout.method == "pq" else "window"
    parts = [window, layout.expansion, "images", "flss", *(["nmm"] if layout.period_m else []), "radiance"]
    constants = _constants(layout, images_path, rgb_from_xyz)
    return "\n".join([*constants, "", *((_PARTS / f"{part}.osl").read_text() for part in parts)])


def _constants(layout: Layout, images_path: Path, rgb_from_xyz: np.ndarray) -> list[str]:
    """What the parts leave open, as the lines that define it."""
    lambdas = wavelengths(layout.step_m)
    table = np.arange(WAVELENGTH_MIN_M, WAVELENGTH_MAX_M + _OBSERVER_STEP_M / 2, _OBSERVER_STEP_M)
    values = {
        "IMAGES": f'"{images_path.absolute().as_posix()}"',
        "WIDTH": float(layout.width),
        "HEIGHT": float(layout.height),
        "TILES_ACROSS": layout.columns,
        "TILE_ROWS": layout.tile_rows,
        "TILE_COLUMNS": layout.tile_columns,
        "TERMS": layout.terms,
        "REACH": layout.texels // 2,
        "LENGTH_U": layout.length_u_m * _UM,
        "LENGTH_V": layout.length_v_m * _UM,
        "ORIGIN_U": layout.tile_columns // 2,
        "ORIGIN_V": layout.tile_rows // 2,
        "SCALE": layout.scale_m * _UM,
        "POWER": layout.power * _UM**2,
        "SIGMA_F": layout.sigma_f / _UM,
        "COPIES_U": layout.copies_u,
        "COPIES_V": layout.copies_v,
        "FIRST_WAVELENGTH": WAVELENGTH_MIN_M * _UM,
        "LAST_WAVELENGTH": WAVELENGTH_MAX_M * _UM,
        "STEP": float(lambdas[1] - lambdas[0]) * _UM,
        "SAMPLES": len(lambdas),
        "WEIGHTS": _colours(spectral_weights(lambdas, layout.illuminant) @ np.transpose(rgb_from_xyz)),
        "RESPONSE": "grating_wavelengths" if layout.period_m else "all_wavelengths",
    }
    if layout.period_m:
        values |= {
            "PERIOD": layout.period_m * _UM,
            "SPECULAR": specular_radius(layout.sigma_f),
            "JACOBIAN": int(layout.method == "nmm-jacobian"),
            "OBSERVER_STEP": _OBSERVER_STEP_M * _UM,
            "OBSERVER_SAMPLES": len(table),
            "OBSERVER": _colours(observer(table, layout.illuminant) @ np.transpose(rgb_from_xyz) / _UM),
        }
    return [f"#define {name} {value}" for name, value in values.items()]


def _colours(values: np.ndarray) -> str:
    return ", ".join(f"color({r:.8g}, {g:.8g}, {b:.8g})" for r, g, b in values)


def _interface(group: bpy.types.NodeTree) -> list[bpy.types.NodeSocket]:
    """The group's sockets, in the order of the shader's parameters."""
    for name, kind, default, text in (
        ("Normal", "NodeSocketVector", None, "Unit shading normal"),
        ("Tangent", "NodeSocketVector", None, "Unit direction of the scan's columns, orthogonal to the normal"),
        ("To Light", "NodeSocketVector", None, "Unit vector to the light"),
        ("Irradiance", "NodeSocketColor", (1.0, 1.0, 1.0, 1.0), "On a surface that faces the light"),
        ("IOR", "NodeSocketFloat", KERATIN_IOR, "Index of refraction"),
    ):
        socket = group.interface.new_socket(name, in_out="INPUT", socket_type=kind, description=text)
        if default is None:
            socket.hide_value = True
        else:
            socket.default_value = default
    group.interface.new_socket("Finer", in_out="OUTPUT", socket_type="NodeSocketColor")
    return list(Tree(group).node("NodeGroupInput").outputs)[:5]
