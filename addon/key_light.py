# SPDX-License-Identifier: GPL-3.0-or-later
"""The key light as properties of the scene, kept by drivers.

Materials read `scene["ng_key_0_direction"]` (unit, to the light) and `scene["ng_key_0_irradiance"]` (W/m2, linear RGB)
with the Attribute node. The drivers are simple expressions: Blender evaluates them with auto-run of scripts off and
without this extension. A material that is appended to another scene follows that scene's light.
"""

import bpy

from ..precompute.failure import GratingError


def direction_name(index: int) -> str:
    return f"ng_key_{index}_direction"


def irradiance_name(index: int) -> str:
    return f"ng_key_{index}_irradiance"


def find_sun(scene: bpy.types.Scene) -> bpy.types.Object:
    """The strongest sun that the scene renders. Raises GratingError if there is none."""
    suns = [o for o in scene.objects if o.type == "LIGHT" and o.data.type == "SUN" and not o.hide_render]
    if not suns:
        raise GratingError(f"scene {scene.name}: no sun lights it; add a Sun lamp, then assign again")
    return max(suns, key=lambda o: o.data.energy)


def follow_sun(scene: bpy.types.Scene, sun: bpy.types.Object) -> None:
    """Make the scene's first key light follow a sun lamp's direction, strength and colour."""
    # The lamp shines along its own -Z, so the light lies along +Z: the third column of its rotation, from its
    # quaternion in world space (parents and constraints included).
    turn = {name: (sun, f"ROT_{name.upper()}") for name in "wxyz"}
    _drive_vector(
        scene,
        direction_name(0),
        ("2 * (x * z + w * y)", "2 * (y * z - w * x)", "1 - 2 * (x * x + y * y)"),
        transforms=turn,
    )
    _drive_vector(
        scene,
        irradiance_name(0),
        tuple(f"energy * pow(2, exposure) * c{i} * (t{i} if heated else 1)" for i in range(3)),
        lamp=sun.data,
    )


def _drive_vector(scene, name: str, expressions, transforms=None, lamp=None) -> None:
    scene[name] = [0.0, 0.0, 0.0]
    path = f'["{name}"]'
    scene.driver_remove(path)
    for index, expression in enumerate(expressions):
        driver = scene.driver_add(path, index).driver
        driver.type = "SCRIPTED"
        for variable, (target, transform) in (transforms or {}).items():
            _add_transform(driver, variable, target, transform)
        if lamp is not None:
            _add_property(driver, "energy", lamp, "energy")
            _add_property(driver, "exposure", lamp, "exposure")
            _add_property(driver, f"c{index}", lamp, f"color[{index}]")
            _add_property(driver, f"t{index}", lamp, f"temperature_color[{index}]")
            _add_property(driver, "heated", lamp, "use_temperature")
        driver.expression = expression


def _add_transform(driver, name: str, target: bpy.types.Object, transform: str) -> None:
    variable = driver.variables.new()
    variable.name = name
    variable.type = "TRANSFORMS"
    variable.targets[0].id = target
    variable.targets[0].transform_type = transform
    variable.targets[0].transform_space = "WORLD_SPACE"
    variable.targets[0].rotation_mode = "QUATERNION"


def _add_property(driver, name: str, lamp: bpy.types.Light, path: str) -> None:
    variable = driver.variables.new()
    variable.name = name
    variable.targets[0].id_type = "LIGHT"
    variable.targets[0].id = lamp
    variable.targets[0].data_path = path
