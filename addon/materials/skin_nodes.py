# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes in a Diffraction group (skin.py names the sockets and the choices of lights), with the footprint of a pixel
and the variation over a skin.

    Shader = (1 - k R) Base + k face + (1 - wd) s (sum over lamps of V Lo + closures),   k = (1 - wd) min(s, 1)

R is what a smooth surface reflects towards the viewer, with the face of a plate (matter_nodes.py): Fresnel's for a
dielectric. Nothing is seen through a metal: it has wd Base + (1 - wd - k) metal in place of (1 - k R) Base, where metal
is a closure of the colour R. A Shader's weight is a number, so R is the luminance above the Base. Lo is the light that
the response (response.py) sends to the viewer from one lamp (lamps/lamp_group.py). V is 1 where the surface sees the
lamp, else 0. face: see matter_nodes.py. From four lamps on, the sum is over two of them in each sample
(lamp_choice.py).

No light counts twice. In REST the closure of the scattered light is a perfect mirror around a random normal, black
where its one direction leads to a followed lamp or source. A lamp's cone has a radius of sqrt(6) standard deviations of
its disc: the corner of a square lamp, and 1.22 radii of a round one. The table and the closure share wide lamps. The
closure is also black where its direction leads to a lamp that the artist leaves out, however wide."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, pairwise

import bpy

from ..blender import compat
from ..direction.tangent_frame import frame_nodes
from ..gratings.grating import ALL, LAMPS_ONLY, REST, Variation
from ..lamps.brightest_lamps import LAMPS_MAX
from ..lamps.lamp_group import (
    Light,
    drive_by_scene,
    lamp_and_point_group,
    lamp_group,
    light_of,
    read_number,
)
from ..lamps.sky import REST_SPECTRUM, source_light
from ..nodes.builder import Operand, Tree, Value, by_group
from ..nodes.interface import Socket
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
from .lamp_choice import (
    ALL_UP_TO,
    NOTHING,
    Answered,
    Candidate,
    Choice,
    after,
    all_after,
    answered_lamp,
    either_group,
    is_lit,
    lamp_candidate,
    lamp_for_table,
    left_by_table,
    left_group,
    light_of_number,
    packed_light,
    random_number,
    rays,
    table_share,
    two_answers,
    whole_light,
)
from .matter_nodes import is_opaque, plate_of, smooth_reflectance
from .response import (
    IRRADIANCE,
    LAYER,
    LAYERED,
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
)
from .shadow import hit, ray_start

# The standard deviation, in pixels, of a Blackman-Harris filter one pixel wide, which ends one pixel from its centre.
_FILTER = 0.0768**0.5
# In EEVEE, up to this many samples each count; of many samples, one in this many counts.
_EEVEE_FEW, _EEVEE_SHARE = 4, 4
# Cosines below this count as this.
_STEEP = 0.05
# The largest variance of the normals, in rad2. Without this limit, a needle a tenth of a pixel wide would be several
# times too bright.
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
    """Add the footprint of a pixel, which is how much the normal varies within it, to a roughness.

    A pixel shows the mean over the part of the surface within it. On a curved surface the normal varies there, and with
    it the visible order; a single sample shows only one of the colours. The coarser blur levels of the table hold their
    mean. Within a pixel, the normals have the variance along one axis

        F^2 = p^2 (sum over x, y, z of |a_i|^2) / 2,     a_i = g_i - N (g_i.wr) / (N.wr),     g_i = grad N_i

    p is the standard deviation of the area that one sample covers: the pixel's width at the surface, times that of the
    pixel filter over the root of the number of samples, because n samples share the filter's area. So the blur shrinks
    as samples accumulate, and the mean of the pixel does not change. EEVEE places its samples identically in each
    frame, which shows as flicker. There p assumes a quarter of the samples, but at least four (or all, if there are
    fewer).

    A normal that turns by a moves the tangential part of the half vector by w a, like a facet of a rough surface. So
    the footprint acts as roughness: Beckmann's slopes have the variance r^4 / 2, and

        r'^4 = r^4 + 2 F^2

    The gradients come from Bump nodes: for a height f and a distance p, a Bump node turns N to N - p grad f. In Cycles
    the normal of the Texture Coordinate node has a gradient and the normal of the Geometry node has none; in EEVEE it
    is the other way round.

    As N is a unit vector, N.a = 0 along each axis of the surface. So x, y and z are the camera's axes, and the two
    across the view are enough:

        a_z = -(N_x a_x + N_y a_y) / N_z

    The blur is round, but the normals of a needle vary along one direction only. A wide round blur would show light
    that no normal reflects. So F^2 is at most (4 degrees)^2, and stronger variation within a pixel keeps some noise.

    Neglected: the turn of the tangent about the normal, and the turn of the view, which is smaller than a pixel's
    angle."""
    return by_group(tree, "Footprint", _footprint, given={"roughness": roughness}, gives={"rougher": "Float"})[0]


def _footprint(tree: Tree, roughness: Value) -> tuple[Value]:
    per_distance = drive_by_scene(tree, _PERSPECTIVE, _CAMERA | {"angle": "camera.data.angle"}, label="Pixel Angle")
    width = drive_by_scene(tree, _ORTHOGRAPHIC, _CAMERA | {"scale": "camera.data.ortho_scale"}, label="Pixel Width")
    in_cycles = drive_by_scene(
        tree,
        f"{_FILTER} * width / sqrt(max(n, 1))",
        {"width": "cycles.filter_width", "n": "cycles.samples"},
        label="In Cycles",
    )
    in_eevee = drive_by_scene(
        tree,
        f"{_FILTER} * width / sqrt(max(n / {_EEVEE_SHARE}, min(max(n, 1), {_EEVEE_FEW})))",
        {"width": "render.filter_size", "n": "eevee.taa_render_samples"},
        label="In EEVEE",
    )
    distance = tree.value(tree.node("ShaderNodeCameraData").outputs["View Distance"])
    cycles = tree.in_cycles()
    p = distance.times_plus(per_distance, width) * tree.choice(cycles, in_eevee, in_cycles)

    geometry, coordinates = tree.node("ShaderNodeNewGeometry"), tree.node("ShaderNodeTexCoord")
    n, wr = (tree.value(geometry.outputs[name]) for name in ("Normal", "Incoming"))
    seen, turned = (
        tree.node("ShaderNodeSeparateXYZ", tree.to_camera(normal, space)).outputs
        for normal, space in ((n, "WORLD"), (tree.value(coordinates.outputs["Normal"]), "OBJECT"))
    )
    x, y, z = map(tree.value, seen)
    backwards = tree.maximum(tree.dot(n, wr), _STEEP) * -1.0
    turns = []
    for n_i, turned_i in zip((x, y), turned[:2], strict=True):
        bump = tree.node("ShaderNodeBump")
        tree.feed(bump.inputs["Strength"], 1.0)
        tree.feed(bump.inputs["Distance"], p)
        # Cycles computes the height three times for each Bump node.
        tree.feed(bump.inputs["Height"], tree.choice(cycles, n_i, tree.value(turned_i)))
        bent = tree.value(bump.outputs["Normal"])
        # bent is along N - p g_i and, as p g_i is small, about as long. The turn is -p a_i.
        turns.append(n.times_plus(tree.maximum(tree.dot(bent, wr), _STEEP) / backwards, bent))
    third = turns[0] * x + turns[1] * y
    total = tree.dot(third, third) / tree.maximum(z * z, _STEEP**2)
    for turn in turns:
        total = total + tree.dot(turn, turn)
    # r'^4 = r^4 + 2 F^2
    squared = roughness * roughness
    return (tree.math("POWER", squared.times_plus(squared, tree.minimum(total, 2 * MOST)), 0.25),)


# With this detail, a Noise Texture is almost normally distributed around 0.5. Its distribution function, within 0.015,
# is (1 + tanh(k (noise - 0.5))) / 2, which makes it uniform.
_DETAIL, _EVEN = 1.0, 8.5
# Positions before modifiers and shape keys; Blender stores them if this is enabled on the object.
REST_POSITION = "rest_position"


def variation_nodes(tree: Tree, variation: Variation) -> tuple[list[Value], Value | None]:
    """How far a point is beyond each bound between reliefs, from 0 to 1; and the turn of the direction in radians, or
    None. Unused variation adds no nodes.

    A pattern is a number x, distributed uniformly from 0 to 1 over the surface. Each relief takes an interval of this
    range as long as its share of the surface: with shares s1, s2, s3 the bounds are b1 = s1 and b2 = s1 + s2. A point
    is S(x - b1) beyond the first, where S is a step from 0 to 1 over the softness."""
    name = variation.pattern_attribute
    by_noise = variation.shares and not name
    place, turning = _noise(tree, variation.size_m) if by_noise or variation.turn else (None, None)
    turn = (turning * 2.0 - 1.0) * variation.turn if turning is not None and variation.turn else None
    if not variation.shares:
        return [], turn
    if name:
        held = tree.node("ShaderNodeAttribute", attribute_type="GEOMETRY", attribute_name=name, label=name)
        place = tree.value(held.outputs["Fac"])
    assert place is not None
    bound, beyond = 1.0 - sum(variation.shares), []
    for share in variation.shares:
        beyond.append(_step(tree, place, bound, variation.softness))
        bound += share
    return beyond, turn


def _shares(beyond: Sequence[Value]) -> list[Value | None]:
    """The share of each relief at a point; None is 1. They add up to 1.

    Patches are wider than the coherence length, so light from different patches does not interfere: their radiances are
    added, weighted by the shares."""
    return [1.0 - beyond[0], *(a - b for a, b in pairwise(beyond)), beyond[-1]] if beyond else [None]


def _layers_of(responses: Sequence[Response]) -> Response | None:
    """The response that holds these as layers, or None. One response has none."""
    if len(responses) < 2:
        return None
    from .direct.layers import layers_of  # most sessions begin without it

    return layers_of(responses)


# The seed of the random number that draws a layer. Those of lamps are 0 and more.
_LAYER_SEED = -2.0


def _layer(tree: Tree, beyond: Sequence[Value], softness: float) -> Value:
    """The number of a relief, which is drawn in proportion to its share: the bounds that a point is beyond, with the
    same random number for each."""
    if softness > 0:
        drawn = random_number(tree, _LAYER_SEED)
        beyond = [tree.math("GREATER_THAN", each, drawn) for each in beyond]
    return sum(beyond[1:], beyond[0])


def _noise(tree: Tree, size_m: float) -> tuple[Value, Value]:
    """Two independent numbers that vary over the surface, each uniform from 0 to 1. They use the rest position where it
    is stored, so that the pattern moves with a deforming skin."""
    held, _ = tree.attribute(REST_POSITION, "GEOMETRY")
    absent = tree.math("LESS_THAN", tree.dot(held, held), 1e-24)
    place = held + tree.value(tree.node("ShaderNodeTexCoord").outputs["Object"]) * absent
    noise = tree.node("ShaderNodeTexNoise", place)
    tree.feed(noise.inputs["Scale"], 1.0 / size_m)
    tree.feed(noise.inputs["Detail"], _DETAIL)
    red, green, _ = tree.node("ShaderNodeSeparateXYZ", tree.value(noise.outputs["Color"])).outputs
    first, second = (
        tree.math("TANH", tree.value(channel).times_plus(_EVEN, -_EVEN / 2)).times_plus(0.5, 0.5)
        for channel in (red, green)
    )
    return first, second


def _step(tree: Tree, place: Value, bound: float, softness: float) -> Value:
    """A step from 0 to 1 at a bound, smooth over the softness."""
    if softness <= 0:
        return tree.math("GREATER_THAN", place, bound)
    ends = (bound - softness / 2, bound + softness / 2)
    node = tree.node("ShaderNodeMapRange", place, *ends, 0.0, 1.0, interpolation_type="SMOOTHSTEP")
    return tree.value(node.outputs["Result"])


AOV_NAME = "Diffraction"
# Weights of a lamp's red, green and blue in a choice among lamps. Any positive weights would do.
_LUMINANCE = (0.2126, 0.7152, 0.0722)
# The light of no lamp.
_DARK = (0.0, 0.0, 0.0)
# So many lamps a Cycles shader, which holds 255 numbers at once, can hold for closures and then for the table. With
# more, closures wait for the table, also for rays that do not see it.
_HELD = 12


@dataclass
class _Lighting:
    """The responses of a group under one light after another.

    reliefs   each response with its number and its share of the surface, None for all of it
    asked     what each response is asked about every light
    closures  the directions of their closures, if these share the light with the table
    rests     what is left for each closure by the lights so far
    weight    of a light: 1 where the surface sees it and the ray may, else 0
    areas     whether there may be area lamps
    rows      whether lights may be of another spectrum than white"""

    tree: Tree
    reliefs: Sequence[tuple[int, tuple[Response, Value | None]]]
    asked: dict[Socket, Operand]
    closures: list[Value]
    rests: Sequence[Value]
    weight: Callable[[Light], Value]
    areas: bool
    rows: bool

    def asked_of(self, light: Light) -> dict[Socket, Operand]:
        of_light: dict[Socket, Operand] = {TO_LIGHT: light.direction, IRRADIANCE: light.irradiance}
        of_light[VARIANCE] = light.variance
        return self.asked | of_light | ({} if light.spectrum is None else {SPECTRUM: light.spectrum})

    def answers(self, light: Light) -> list[Value]:
        """What each response sends to the viewer from a light."""
        asked = self.asked_of(light)
        return [response.to_lamp(self.tree, asked, number=k) for k, (response, _) in self.reliefs]

    def share_of_table(self, light: Light) -> Value | None:
        """The table's share of a light that closures show too, else None."""
        return table_share(self.tree, light) if self.closures else None

    def likely(self, light: Light, share: Value | None) -> Value:
        """About how much of a light, or of the table's share of it, reaches the viewer."""
        sent = self.tree.dot(light.irradiance, _LUMINANCE)
        asked = self.asked_of(light)
        parts = [(response.likely(self.tree, asked, number=k), area) for k, (response, area) in self.reliefs]
        total = sum((part if area is None else part * area for part, area in parts), 0.0)
        return total * (sent if share is None else sent * share)

    def without(self, light: Light, share: Value | float) -> list[Value]:
        """What is left for each closure if the table shows a share of a further light."""
        pairs = zip(self.closures, self.rests, strict=True)
        return [left_by_table(self.tree, light, share, direction=direction) * rest for direction, rest in pairs]

    def two_of(self, candidates: Iterable[Candidate]) -> list[Answered]:
        """Two lights in place of all, of which nothing more is left for closures."""
        seen, chances = [], []
        for candidate in candidates:  # one by one: see lamp_choice.py
            share = self.share_of_table(candidate.light)
            chance = self.likely(candidate.light, share)
            if share is not None:
                self.rests = after(chance, self.without(candidate.light, share))
            seen.append(candidate)
            chances.append(chance)
        return two_answers(self.tree, seen, all_after(chances, self.rests) if self.closures else chances)

    def two_of_all(self, lights: Sequence[Answered]) -> list[tuple[Operand, float, Operand]]:
        """The same by a loop: the numbers of two lights (lamp_choice.Choice.numbers)."""
        fields = len(Choice._fields)

        def turn(item: Sequence[Operand], state: Sequence[Value]) -> list[Value]:
            *packed, row = item
            choice, rests = Choice(*state[:fields]), state[fields:]
            light = whole_light(self.tree, packed, areas=self.areas, row=self.spectrum(row))
            share = self.share_of_table(light)
            chance = self.likely(light, share)
            if share is not None:
                self.rests = rests
                rests = self.rests = after(chance, self.without(light, share))
                (chance,) = all_after([chance], rests)
            return [*choice.with_light(self.tree, chance), *rests]  # type: ignore[list-item]  # as the state

        begin = [*Choice.of_none(self.tree), *(self.rests if self.closures else ())]
        ended = self.tree.for_each([(*light.packed, light.row) for light in lights], begin, turn)
        self.rests = ended[fields:] if self.closures else self.rests
        return Choice(*ended[:fields]).numbers(self.tree)

    def spectrum(self, row: Operand) -> Value | None:
        """A light's row in the table of lamps, None if all are white."""
        return row if self.rows and isinstance(row, Value) else None

    def lit_by(self, light: Answered) -> tuple[Light, Light]:
        """A light that is answered to: the whole for closures, and as the table shows it."""
        row = self.spectrum(light.row)
        whole, shown = packed_light(self.tree, light.packed, areas=self.areas, row=row, seed=light.seed)
        if light.factor == 1.0:
            return whole, shown
        return whole, replace(shown, irradiance=shown.irradiance * light.factor)

    def sent(self, whole: Light, shown: Light, *, leaves: bool) -> tuple[list[Value], Value]:
        """What the responses send to the viewer from a light, and its weight. `leaves`: closures get what is left."""
        share, weight = self.share_of_table(shown), self.weight(shown)
        if share is None:
            return self.answers(shown), weight
        if leaves:
            self.rests = self.without(whole, share if whole is shown else table_share(self.tree, whole))
            for rest in self.rests:
                weight = rest.times_plus(NOTHING, weight)
        return self.answers(shown), weight * share

    def from_each(self, lights: Iterable[tuple[Light, Light]], *, leaves: bool) -> Iterator[list[Value]]:
        """What the responses send from one light after another."""
        for whole, shown in lights:
            answers, weight = self.sent(whole, shown, leaves=leaves)
            yield [answer * weight for answer in answers]

    def from_all(
        self, lights: Sequence[Answered], *, leaves: bool, numbers: Sequence[Sequence[Operand]] = ()
    ) -> list[Value]:
        """Sum what the responses send from all lights by a loop. `numbers`: sum only these lights (two_of_all)."""
        count = len(self.reliefs)
        leaves = leaves and bool(self.closures)

        def turn(item: Sequence[Operand], state: Sequence[Value]) -> list[Value]:
            *light, seed, factor = item
            packed, row = light_of_number(self.tree, light[0], lights) if numbers else (light[:-1], light[-1])
            totals, rests = state[:count], state[count:]
            if leaves:
                self.rests = rests
            answers, weight = self.sent(*self.lit_by(Answered(packed, row, seed, factor)), leaves=leaves)
            sums = (answer.times_plus(weight, total) for answer, total in zip(answers, totals, strict=True))
            return [*sums, *(self.rests if leaves else ())]

        items = numbers or [(*light.packed, light.row, light.seed, light.factor) for light in lights]
        ended = self.tree.for_each(items, [*[_DARK] * count, *(self.rests if leaves else ())], turn)
        sums, rests = list(ended[:count]), ended[count:]
        if leaves and len(items) > _HELD:
            rests = [self.tree.dot(sums[0], (NOTHING,) * 3) + rest for rest in rests]
        self.rests = rests or self.rests
        return sums


def make_nodes(group: bpy.types.NodeTree, responses: tuple[Response, ...], lamps: list[bool], *, sources: int) -> None:
    """Rebuild a Diffraction group's nodes for lamps and a number of sources."""
    group.nodes.clear()
    tree = Tree(group)
    inputs = tree.inputs()
    variation = variation_of(group).of_others(len(responses) - 1)
    beyond, turn = variation_nodes(tree, variation)
    responses = responses[: len(beyond) + 1]  # shares of further responses may be missing
    if turn is not None:
        inputs["Rotation"] = inputs["Rotation"] + turn
    n, t = frame_nodes(tree, inputs, frame_of(group))
    geometry = tree.node("ShaderNodeNewGeometry")
    cos_r = tree.dot(tree.value(geometry.outputs["Incoming"]), n)
    unseen, least_roughness = rays(tree)
    seeing = 1.0 - unseen
    coated = 1.0 - inputs["Base Blend"]
    strength, covered = inputs["Strength"] * coated, tree.minimum(inputs["Strength"], 1.0) * coated
    settings: dict[Socket, Value] = {socket: inputs[socket.name] for socket in SETTINGS}
    reliefs: list[tuple[int, tuple[Response, Value | None]]]
    if (layered := _layers_of(responses)) is None:
        reliefs = list(enumerate(zip(responses, _shares(beyond), strict=True), start=1))
    else:
        for k, response in enumerate(responses, start=1):
            response.keep(tree, number=k)
        reliefs, settings[LAYER] = [(LAYERED, (layered, None))], _layer(tree, beyond, variation.softness)
    start = ray_start(tree, geometry) if traces_shadows(group) else None
    to_lamps = dict(settings)
    if counts_footprint(group):
        to_lamps[ROUGHNESS] = with_footprint(tree, settings[ROUGHNESS])
    to_lamps[ROUGHNESS] = tree.maximum(to_lamps[ROUGHNESS], least_roughness)
    # Unlinked nodes cost nothing. They keep groups in the file that more lamps, or an area lamp, need later: Blender's
    # undo would lose a group that a handler makes.
    left = left_group(is_whole=False), left_group(is_whole=True)
    chosen = () if compat.HAS_LOOPS else (either_group(),)
    for made in (lamp_group(), *chosen, lamp_and_point_group(), *left):
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
    areas_of_lamps = areas_in(group) if lights == REST else set()
    of_sources = [source_light(tree, k, coloured=of_world) for k in range(sources)] if lights == REST else []

    def weight(light: Light) -> Value:
        seen = is_lit(tree, light, n=n, cos_r=cos_r, unseen=unseen)
        if start is None:
            return seen
        return seen * (1.0 - light.casts_shadow * hit(tree, start, light.direction, distance=light.distance))

    lighting = _Lighting(
        tree, reliefs,
        asked={NORMAL: n, TANGENT: t, ZERO_ORDER: float(lights == LAMPS_ONLY), **to_lamps},
        closures=[world.direction for world in worlds if world is not None] if lights == REST else [],
        rests=[strength * seeing if lights == REST else strength] * len(worlds),
        weight=weight, areas=bool(areas_of_lamps), rows=bool(coloured) or of_world,
    )  # fmt: skip
    count = len(lamps) + len(of_sources)
    drawn = count > ALL_UP_TO and not answers_every_lamp(group)
    drawn = drawn and all(response.tells_likely for response in responses)
    sent: Iterable[list[Value]]
    if compat.HAS_LOOPS and count > 1:
        answered = [answered_lamp(tree, k, linked, coloured=k in coloured) for k, linked in enumerate(lamps)]
        answered += [Answered(packed, light.spectrum or 0.0, 0.0) for light, packed in of_sources]
        numbers = lighting.two_of_all(answered) if drawn else ()
        sent = [lighting.from_all(answered, leaves=not drawn, numbers=numbers)]
    elif drawn:
        of_lamps = (
            lamp_candidate(tree, k, linked, is_area=k in areas_of_lamps, coloured=k in coloured)
            for k, linked in enumerate(lamps)
        )
        two = lighting.two_of(chain(of_lamps, (Candidate(packed, light) for light, packed in of_sources)))
        sent = lighting.from_each(map(lighting.lit_by, two), leaves=False)
    else:
        each_lamp = (
            lamp_for_table(tree, k, linked, is_area=k in areas_of_lamps, coloured=k in coloured)
            for k, linked in enumerate(lamps)
        )
        sent = lighting.from_each(chain(each_lamp, ((light, light) for light, _ in of_sources)), leaves=True)
    shader: Value | None = None
    radiance: Operand = _DARK
    for radiances in sent:
        for (_, (_, area)), each in zip(reliefs, radiances, strict=True):
            shown = each if area is None else each * area
            radiance = shown if radiance == _DARK else radiance + shown
            if lights != ALL:
                # Cycles evaluates nothing where the share is 0.
                seen = seeing if area is None else seeing * area
                shader = tree.add_shader(shader, tree.mix_shader(seen, None, tree.emission(each, strength)))
    for index in range(left_out_in(group)) if lights == REST else ():
        lighting.rests = lighting.without(light_of(tree, LAMPS_MAX + index, False), 1.0)
    with_rests = zip(worlds, lighting.rests, reliefs, strict=True)
    for world, rest, (_, (response, area)) in with_rests if lights != LAMPS_ONLY else ():
        assert world is not None  # otherwise lights is LAMPS_ONLY
        closures = world.closures(n, strength, rest)
        if (plate := plate_of(response.group)).present:
            closures = tree.add_shader(closures, plate.face(tree, n, covered))
        shader = tree.add_shader(shader, closures if area is None else tree.mix_shader(area, None, closures))
    shader = tree.add_shader(shader, _base(tree, inputs, reliefs, n=n, cos_r=cos_r, shares=(coated, covered)))
    radiance = radiance * strength
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
