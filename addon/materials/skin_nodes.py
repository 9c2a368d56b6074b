# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes in a Diffraction group (skin.py names the sockets and the choices of lights).

    Shader = (1 - k R) Base + k face + (1 - wd) s (sum over lamps of V Lo + closures),   k = (1 - wd) min(s, 1)

R is what a smooth surface reflects towards the viewer, with the face of a plate (matter_nodes.py): Fresnel's for a
dielectric. Nothing is seen through a metal: it has wd Base + (1 - wd - k) metal in place of (1 - k R) Base, where metal
is a closure of the colour R. A Shader's weight is a number, so R is the luminance above the Base. Lo is the light that
the response (response.py) sends to the viewer from one lamp (lamps/lamp_group.py). V is 1 where the surface sees the
lamp, else 0. face: see plate_nodes.py. From four lamps on, the sum is over two of them in each sample (two_answers.py).

No light counts twice. In REST the closure of the scattered light is a perfect mirror around a random normal, black
where its one direction leads to a followed lamp or source. A lamp's cone has a radius of sqrt(6) standard deviations of
its disc: the corner of a square lamp, and 1.22 radii of a round one. The table and the closure share wide lamps. The
closure is also black where its direction leads to a lamp that the artist leaves out, however wide."""

from itertools import zip_longest

import bpy

from ..direction.tangent_frame import frame_nodes
from ..gratings.lights_choice import ALL, LAMPS_ONLY, REST
from ..lamps.area_lamp import lamp_and_point_group
from ..lamps.driven_nodes import read_number
from ..lamps.find import LAMPS_MAX
from ..lamps.lamp_group import Light, lamp_group, light_of
from ..lamps.sky import REST_SPECTRUM
from ..lamps.sky_nodes import source_light
from ..nodes.builder import Operand, Tree, Value
from ..nodes.interface import Socket
from .footprint import with_footprint
from .group_properties import (
    answers_every_lamp,
    areas_in,
    coloured_in,
    counts_footprint,
    frame_of,
    left_out_in,
    lights_of,
    reads_source_spectra,
    traces_shadows,
    variation_of,
)
from .light_masks import is_lit, rays
from .matter_nodes import is_opaque, plate_of, smooth_reflectance
from .response import (
    IRRADIANCE,
    NORMAL,
    ROUGHNESS,
    SETTINGS,
    SHARP,
    SPECTRUM,
    TANGENT,
    TO_LIGHT,
    VARIANCE,
    ZERO_ORDER,
    Response,
    Shown,
)
from .shadow import hit, ray_start
from .two_answers import ALL_UP_TO, either_group, two_answers
from .variation_nodes import variation_nodes
from .wide_lamps import lamp_for_table, left_by_table, left_group, table_share

AOV_NAME = "Diffraction"
# Weights of a lamp's red, green and blue in a choice among lamps. Any positive weights would do.
_LUMINANCE = (0.2126, 0.7152, 0.0722)


def make_nodes(group: bpy.types.NodeTree, responses: tuple[Response, ...], lamps: list[bool], *, sources: int) -> None:
    """Rebuild a Diffraction group's nodes for lamps and a number of sources."""
    group.nodes.clear()
    tree = Tree(group)
    inputs = tree.inputs()
    areas, turn = variation_nodes(tree, variation_of(group).of_others(len(responses) - 1))
    responses = responses[: len(areas)]  # shares of further responses may be missing
    if turn is not None:
        inputs["Rotation"] = inputs["Rotation"] + turn
    n, t = frame_nodes(tree, inputs, frame_of(group))
    geometry = tree.node("ShaderNodeNewGeometry")
    cos_r = tree.dot(tree.value(geometry.outputs["Incoming"]), n)
    unseen, least_roughness = rays(tree)
    coated = 1.0 - inputs["Base Blend"]
    strength, covered = inputs["Strength"] * coated, tree.minimum(inputs["Strength"], 1.0) * coated
    settings = {socket: inputs[socket.name] for socket in SETTINGS}
    start = ray_start(tree, geometry) if traces_shadows(group) else None
    to_lamps = dict(settings)
    if counts_footprint(group):
        to_lamps[ROUGHNESS] = with_footprint(tree, settings[ROUGHNESS])
    to_lamps[ROUGHNESS] = tree.maximum(to_lamps[ROUGHNESS], least_roughness)
    reliefs = list(enumerate(zip(responses, areas, strict=True), start=1))
    # Unlinked nodes cost nothing. They keep groups in the file that more lamps, or an area lamp, need later: Blender's
    # undo would lose a group that a handler makes.
    for made in (lamp_group(), either_group(), lamp_and_point_group(), left_group()):
        tree.group(made)
    # Likewise the response's World group, while it is unused.
    spectral = any(response.is_spectral for response in responses)
    coloured = coloured_in(group) if spectral else set()
    lights = lights_of(group) if all(response.world is not None for response in responses) else LAMPS_ONLY
    asked_of_world: dict[Socket, Operand] = {NORMAL: n, TANGENT: t, SHARP: float(lights == REST), **to_lamps}
    of_world = spectral and lights == REST and reads_source_spectra(group)
    if of_world:
        asked_of_world[SPECTRUM] = read_number(tree, REST_SPECTRUM)
    worlds = [response.to_world(tree, asked_of_world, number=k) for k, (response, _) in reliefs]
    zero_order = float(lights == LAMPS_ONLY)
    whole: list[Light] = []
    left_out: list[Light] = []
    if lights == REST:
        pairs = [
            lamp_for_table(tree, k, linked, is_area=k in areas_in(group), coloured=k in coloured)
            for k, linked in enumerate(lamps)
        ]
        found = (source_light(tree, index, coloured=of_world) for index in range(sources))
        pairs += [(source, source) for source in found]
        whole, lit_by = ([pair[which] for pair in pairs] for which in range(2))
        left_out = [light_of(tree, LAMPS_MAX + index, False) for index in range(left_out_in(group))]
    else:
        lit_by = [light_of(tree, index, linked, coloured=index in coloured) for index, linked in enumerate(lamps)]
    shares = [table_share(tree, light) for light in lit_by] if lights == REST else []
    not_for_closures: list[tuple[Light, Value | float]] = [(light, table_share(tree, light)) for light in whole]
    not_for_closures += [(light, 1.0) for light in left_out]

    def asked_of(light: Light) -> dict[Socket, Operand]:
        asked: dict[Socket, Operand] = {NORMAL: n, TANGENT: t, ZERO_ORDER: zero_order, **to_lamps}
        if light.spectrum is not None:
            asked[SPECTRUM] = light.spectrum
        return asked | {TO_LIGHT: light.direction, IRRADIANCE: light.irradiance, VARIANCE: light.variance}

    def likely(light: Light, share: Value | None) -> Value:
        sent = tree.dot(light.irradiance, _LUMINANCE)
        parts = [(response.likely(tree, asked_of(light), number=k), area) for k, (response, area) in reliefs]
        total = sum((part if area is None else part * area for part, area in parts), 0.0)
        return total * (sent if share is None else sent * share)

    drawn = len(lit_by) > ALL_UP_TO and not answers_every_lamp(group)
    if drawn and all(response.tells_likely for response in responses):
        lit_by = two_answers(tree, lit_by, [likely(*each) for each in zip_longest(lit_by, shares)])
        shares = [table_share(tree, light) for light in lit_by] if shares else []
    coat: Shown | None = None
    for light, share in zip_longest(lit_by, shares):
        lit = is_lit(tree, light, n=n, cos_r=cos_r, unseen=unseen)
        asked = asked_of(light)
        answer: Shown | None = None
        for k, (response, area) in reliefs:
            shown = response.to_lamp(tree, asked, number=k).shown(strength)
            answer = (shown if area is None else shown.dimmed(area)).added_to(answer)
        assert answer is not None  # there is at least one response
        if start is not None:
            sees = 1.0 - light.casts_shadow * hit(tree, start, light.direction, distance=light.distance)
            answer = answer.dimmed(sees)
        coat = answer.dimmed(lit if share is None else lit * share).added_to(coat)
    assert coat is not None  # there is at least one lamp input
    shader = coat.shader if lights != ALL else None
    for world, (_, (response, area)) in zip(worlds, reliefs, strict=True) if lights != LAMPS_ONLY else ():
        assert world is not None  # otherwise lights is LAMPS_ONLY
        rest = strength
        if lights == REST:
            rest = strength * (1.0 - unseen) * left_by_table(tree, not_for_closures, world.direction)
        closures = world.closures(n, strength, rest)
        if (plate := plate_of(response.group)).present:
            closures = tree.add_shader(closures, plate.face(tree, n, covered))
        shader = tree.add_shader(shader, closures if area is None else tree.mix_shader(area, None, closures))
    shader = tree.add_shader(shader, _base(tree, inputs, reliefs, n=n, cos_r=cos_r, shares=(coated, covered)))
    radiance = coat.radiance * strength
    tree.node("ShaderNodeOutputAOV", radiance, aov_name=AOV_NAME)
    tree.output(shader, radiance)


def _base(
    tree: Tree, inputs: dict[str, Value], reliefs: list[tuple[int, tuple[Response, Value | None]]], *,
    n: Value, cos_r: Value, shares: tuple[Value, Value],
) -> Value:  # fmt: skip
    """The shader of the base, and of the smooth metals where a metal's relief is weak. `shares`: 1 - wd, and k."""
    coated, covered = shares
    metals: Value | None = None
    hidden: Value | float = 0.0
    for _, (response, area) in reliefs:
        smooth = smooth_reflectance(tree, response.group, cos_r)
        if is_opaque(response.group):
            hides = coated
            if smooth is not None:
                metal = tree.mix_shader(coated - covered, None, tree.glossy(smooth[0], inputs["Roughness"], n))
                metals = tree.add_shader(metals, metal if area is None else tree.mix_shader(area, None, metal))
        else:
            hides = covered * (tree.fresnel(inputs["IOR"], n) if smooth is None else smooth[1])
        hidden = hides if area is None else hides.times_plus(area, hidden)
    return tree.add_shader(metals, tree.mix_shader(hidden, inputs["Base"], None))
