# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a bake's atlas (precompute/table/atlas.py) by nodes: the table, the zero order, the gains of a plate, and the
colours of its channels under a lamp (precompute/colour/channels.py).

They need directions in tangent space, the small slope reflectance and the ratio form (precompute/optics/brdf.py), and
the scene's linear space (precompute/colour/spaces.py)."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import bpy
import numpy as np

from ...precompute.colour.channels import channel_count, lamp_table, lamps_of_table
from ...precompute.optics.brdf import IOR_MAX
from ...precompute.table.atlas import STRIP_ROWS, Layout
from ...precompute.table.blur_levels import COLUMNS_BESIDE, TILE_PADDING
from ...precompute.table.plate_gains import disc_texel
from ..blender import stored
from ..blender.working_space import working_space
from ..lamps.lamp_spectrum import FURTHER_MAX, further_spectra
from ..nodes.builder import Operand, Tree, Value, by_group
from .pictures import fault_of, note_content, note_pictures


@dataclass(frozen=True)
class Direction:
    """A unit vector in tangent space: its components along T, B and N."""

    x: Value
    y: Value
    cosine: Value

    @cached_property
    def vector(self) -> Value:
        """The components as a vector."""
        return self.cosine.tree.vector(self.x, self.y, self.cosine)

    @cached_property
    def on_disc(self) -> Value:
        """The place on a disc of directions (precompute/table/plate_gains.py)."""
        tree = self.cosine.tree
        given = {"vector": self.vector, "cosine": self.cosine}
        return by_group(tree, "Place on Disc", _place_on_disc, given=given, gives={"place": "Vector"})[0]

    @classmethod
    def seen_in(cls, tree: Tree, direction: Value, frame: tuple[Value, Value, Value]) -> Direction:
        """A direction from world space, given the axes (T, B, N)."""
        return cls(*(tree.dot(direction, axis) for axis in frame))


@dataclass(frozen=True)
class Atlas:
    """The picture of one bake, or of several bakes of one layout, stacked upward. `layer` chooses the bake to read,
    counted from the bottom; None if there is only one."""

    image: bpy.types.Image
    layout: Layout
    layers: int = 1
    layer: Value | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of the picture."""
        return self.layout.width, self.layout.height * self.layers

    def raised(self, y: float) -> Operand:
        """A place in the lowest layer, as a share of the picture's rows, in the layer to read."""
        return y if self.layer is None else self.layer.times_plus(1 / self.layers, y)


def of_layer(layer: Value | None, values: Sequence[float]) -> Value | float:
    """The layer's own of the values: a constant if all are equal, else the polynomial through all of them."""
    if layer is None or len(set(values)) == 1:
        return values[0]
    powers = np.vander(range(len(values)), increasing=True)
    first, *others, last = np.linalg.solve(powers, values).tolist()
    total: Operand = last
    for each in reversed(others):
        total = layer.times_plus(total, each)
    return layer.times_plus(total, first)


# Sums of at most this many Chebyshev polynomials are evaluated as powers, whose coefficients are then at most 20.
_FEW = 6
# The least of a table's likely light over its scale.
_LIKELY_LEAST = 1e-3
# The largest single-precision error at the end of a range, of a sum of two unit vectors or of w scaled to -1 to 1.
_ROUNDING = 1e-5


# A place in a bake's picture: that of the first term at a blur level.
Place = tuple[Value, Value]


class AtlasTable:
    """sum_k f_k(t) B_k(u, v) / scale, XYZ over w^2, with one look-up per term. t is w, scaled to the range -1 to 1.

    `inside` is 1 within the table's region and range of w, else 0. The caller multiplies by it. Look-ups are clamped to
    the rim, because the polynomials grow beyond it and neighbouring tiles begin. `inside` is also 0 for (u, v) beyond
    any pair of directions, which only a stretched relief reaches."""

    def __init__(self, tree: Tree, atlas: Atlas, *, uv: tuple[Value, Value], w: Value):
        layout = atlas.layout
        self.tree, self.image, self.layout, self.size = tree, atlas.image, layout, atlas.size
        inner = [_clamped(tree, along, *range_) for along, range_ in zip(uv, layout.region, strict=True)]
        # The centre of the first inner texel of the first term's tile on level 0.
        left, low = (n + TILE_PADDING + 0.5 for n in layout.tile_origin(0))
        x, y, _ = _over((left, low), self.size)
        self.first = x, atlas.raised(y)
        steps = _over(1 / layout.texel, self.size)
        self.place = tuple(
            along.times_plus(step, -lowest * step)
            for along, step, (lowest, _) in zip(inner, steps, layout.region, strict=False)
        )
        half_range = (layout.w_max - layout.w_min) / 2
        t = w.times_plus(1 / half_range, -(layout.w_min + layout.w_max) / 2 / half_range)
        self.t = _clamped(tree, t, -1.0, 1.0)
        self.functions = None if layout.has_polynomials else _functions(tree, layout, self.t)
        self.inside = tree.math("LESS_THAN", tree.sum_of_squares(*uv), layout.farthest**2)
        if not layout.whole:
            beyond = [there - here for there, here in zip((*uv, t), (*inner, self.t), strict=True)]
            self.inside = self.inside * tree.math("LESS_THAN", tree.sum_of_squares(*beyond), _ROUNDING**2)

    def around(self, blur: Value) -> tuple[Place, Place | None, Value | float]:
        """The places of the two blur levels around a variance, and the mixing share of the coarser level.

        `blur` is the variance in addition to the bake's own. The share gives the mix the right variance. Beyond the
        last level it exceeds 1, and the Mix Shader clamps it. A table with one level gives None and a share of 0."""
        layout, tree = self.layout, self.tree
        if layout.levels == 1:
            return self.sharp, None, 0.0
        cell, spacing = layout.cell, layout.spacing
        # The variance plus the offset, over that of level 0: a geometric sequence over the levels.
        grown = blur.times_plus(1 / (1 + spacing.offset) / layout.sigma_b**2, 1.0)
        level = tree.math("FLOOR", tree.math("LOGARITHM", grown, spacing.ratio))
        level = tree.minimum(level, layout.levels - 2.0)
        power = tree.math("POWER", cell.shrink, level)
        steps = 1 / (spacing.ratio - 1)
        share = (grown * tree.squared(power)).times_plus(steps, -steps)
        # Level 0 has finer texels than the others' rule gives.
        shrink = tree.maximum(power * (1 / cell.coarser), level.times_plus(-1.0, 1.0))
        finer = self._at(level, shrink, may_be_first=True)
        return finer, self._at(level + 1.0, power * (cell.shrink / cell.coarser)), share

    @property
    def sharp(self) -> Place:
        """The place of the level with the bake's own blur only."""
        return self.place[0] + self.first[0], self.place[1] + self.first[1]

    def likely(self, variance: Value) -> Value:
        """About the sum under a kernel of a variance, by one look-up: its first term on the nearest level. Never 0."""
        tree, layout, cell = self.tree, self.layout, self.layout.cell
        spacing = layout.spacing
        at = self.sharp
        if layout.levels > 1:
            # Half a level more, so that rounding down gives the nearest.
            steps = spacing.ratio**0.5 / (1 + spacing.offset)
            grown = variance.times_plus(steps / layout.sigma_b**2, steps * spacing.offset)
            level = tree.math("FLOOR", tree.math("LOGARITHM", grown, spacing.ratio))
            level = _clamped(tree, level, 1.0, layout.levels - 1.0)
            at = self._at(level, tree.math("POWER", cell.shrink, level) * (1 / cell.coarser))
        settings = {"image": self.image, "interpolation": "Closest", "extension": "EXTEND"}
        node = tree.node("ShaderNodeTexImage", tree.vector(*at, 0.0), label="Likely", **settings)
        # As a number the colour is a mean of X, Y and Z.
        return tree.maximum(tree.value(node.outputs["Color"]), _LIKELY_LEAST)

    def _at(self, level: Value, shrink: Value, *, may_be_first: bool = False) -> Place:
        """The image position of the first term at a blur level, by the rule in table/blur_levels.py. `shrink`:
        the level's texels along an axis over level 0's. On level 0 the rule gives at most 0, where it begins."""
        tree, cell = self.tree, self.layout.cell
        along = level.times_plus(
            float(COLUMNS_BESIDE), shrink.times_plus(-cell.geometric, cell.column_end + cell.phase)
        )
        if may_be_first:
            along = tree.maximum(along, 0.0)
        x: Operand = tree.math("FLOOR", along).times_plus(1 / self.size[0], self.first[0])
        y: Operand = self.first[1]
        if cell.shelf < cell.levels:
            left, upward, _ = _over(cell.upper, self.size)
            above = tree.math("GREATER_THAN", level, cell.shelf - 0.5)
            x, y = above.times_plus(-left, x), above.times_plus(upward, y)
        return self.place[0].times_plus(shrink, x), self.place[1].times_plus(shrink, y)

    def read(self, place: Place, triple: int = 0) -> Value:
        """The sum at a place: XYZ, or the next three channels of a triple (precompute/colour/channels.py).

        The terms' tiles form columns and rows, so their positions need one addition per column and per row. A vector
        addition per term would take more of EEVEE's 64 KiB for a material's constants."""
        tree, layout, (x, y) = self.tree, self.layout, place
        first = layout.cell_origin(0)
        columns, rows = {first[0]: x}, {first[1]: y}
        terms = []
        for k in range(layout.terms):
            column, row = layout.cell_origin(k, triple)
            if column not in columns:
                columns[column] = x + (column - first[0]) / self.size[0]
            if row not in rows:
                rows[row] = y + (row - first[1]) / self.size[1]
            terms.append(tree.image(self.image, tree.vector(columns[column], rows[row], 0.0), _label("B", k, triple)))
        if self.functions is None:
            return _chebyshev_sum(terms, self.t)
        total = terms[0] * self.functions[0]
        for term, function in zip(terms[1:], self.functions[1:], strict=True):
            total = term.times_plus(function, total)
        return total


def _clamped(tree: Tree, value: Value, low: float, high: float) -> Value:
    return tree.maximum(tree.minimum(value, high), low)


def _chebyshev_sum(terms: list[Value], t: Value) -> Value:
    """sum_k T_k(t) B_k by Clenshaw's recurrence: b_k = B_k + 2 t b_(k+1) - b_(k+2), the sum B_0 + t b_1 - b_2."""
    twice = t * 2.0
    after, last = None, terms[-1]
    for term in terms[-2:0:-1]:
        after, last = last, last.times_plus(twice, term if after is None else term - after)
    return last.times_plus(t, terms[0] if after is None else terms[0] - after)


def _functions(tree: Tree, layout: Layout, t: Value) -> list[Value]:
    """Each term's function of w, a sum of Chebyshev polynomials. Three functions at a time are the components of a
    vector."""
    found = []
    coefficients = np.zeros((-(-layout.terms // 3) * 3, layout.polynomials))
    coefficients[: layout.terms] = np.reshape(layout.basis, (layout.terms, layout.polynomials))
    powers = [t]
    while layout.polynomials > _FEW << (len(powers) - 1):
        powers.append(tree.squared(powers[-1]).times_plus(2.0, -1.0))
    for three in coefficients.reshape(-1, 3, layout.polynomials):
        split = tree.node("ShaderNodeSeparateXYZ", _chebyshev(tree, three.T, powers))
        found += [tree.value(socket) for socket in split.outputs]
    return found[: layout.terms]


def _chebyshev(tree: Tree, coefficients: np.ndarray, powers: list[Value]) -> Operand:
    """sum_j coefficients_j T_j(t), for coefficients (n, 3). `powers` are t, s = T_2(t), T_2(s) and so on.

    A long sum is split into its even and its odd polynomials: T_2k(t) = T_k(s), and T_(2k+1)(t) = t O_k(s), where O_k =
    2 T_k - O_(k-1). A short sum is one of powers, by Horner's rule. In single precision powers of higher degrees would
    lose digits, because their coefficients are large and cancel."""
    t, *others = powers
    if len(coefficients) <= _FEW:
        of_powers = np.zeros_like(coefficients)
        for j, coefficient in enumerate(coefficients):
            of_powers[: j + 1] += np.polynomial.chebyshev.cheb2poly([0.0] * j + [1.0])[:, None] * coefficient
        # a + t b is a mix, by the share t, of a and a + b. So each power's coefficient is added to all lower ones.
        *sums, mixed = _vectors(np.cumsum(of_powers, axis=0))
        for each in reversed(sums):
            mixed = tree.blend(t, each, mixed)
        return mixed
    odd = coefficients[1::2].copy()
    for j in reversed(range(len(odd) - 1)):
        odd[j] -= odd[j + 1]
    odd[1:] *= 2.0
    return tree.arithmetic(
        "MULTIPLY_ADD", _chebyshev(tree, odd, others), t, _chebyshev(tree, coefficients[::2], others)
    )


def _vectors(rows: np.ndarray) -> list[Operand]:
    """Rows (n, 3) as constants."""
    return [(float(x), float(y), float(z)) for x, y, z in rows]


def _over(value: float | tuple[float, float], size: tuple[int, int]) -> tuple[float, float, float]:
    """Texels along x and y as a fraction of the image."""
    x, y = value if isinstance(value, tuple) else (value, value)
    return x / size[0], y / size[1], 0.0


def _label(letter: str, number: int | str, triple: int) -> str:
    return f"{letter}{number}" + (f" of channels {3 * triple + 1} to {3 * triple + 3}" if triple else "")


def zero_order_at(tree: Tree, atlas: Atlas, *, w: Value, triple: int = 0) -> Value:
    """Z(w), the colour of the zero order (the mirror image), in XYZ or the next three channels of a triple."""
    step, (width, height) = (atlas.layout.zero_order_samples - 1) / 2, atlas.size
    x = w.times_plus(step / width, 0.5 / width)
    y = atlas.raised(STRIP_ROWS * (triple + 0.5) / height)
    return tree.image(atlas.image, tree.vector(x, y, 0.0), _label("Z", "", triple))


def scattered_gain(tree: Tree, atlas: Atlas, *, way: Direction) -> Value:
    """The gain g of scattered light for a direction above the plate (precompute/table/plate_gains.py), equal in all
    channels."""
    return _on_disc(tree, atlas, way=way, block=atlas.layout.gain_block(0), label="Gain")


def mirror_gain(tree: Tree, atlas: Atlas, *, way: Direction, triple: int = 0) -> Value:
    """What the zero order's colour has more under a plate than T(ti) T(tr) Z, towards a direction above it, in XYZ or
    the next three channels."""
    block = atlas.layout.gain_block(1 + triple)
    return _on_disc(tree, atlas, way=way, block=block, label=_label("Mirror Gain", "", triple))


def _on_disc(tree: Tree, atlas: Atlas, *, way: Direction, block: tuple[slice, slice], label: str) -> Value:
    """A table over a disc of directions (precompute/table/plate_gains.py), at a direction. `block` is its place."""
    rows, columns = block
    middle = (columns.start + columns.stop) / 2, (rows.start + rows.stop) / 2
    step = _over(1 / disc_texel(rows.stop - rows.start), atlas.size)
    x, y, _ = _over(middle, atlas.size)
    raised = atlas.raised(y)
    at = (x, raised, 0.0) if isinstance(raised, float) else tree.vector(x, raised, 0.0)
    return tree.image(atlas.image, way.on_disc.times_plus(step, at), label=label)


def _place_on_disc(tree: Tree, vector: Value, cosine: Value) -> tuple[Value]:
    cosine = tree.maximum(cosine, 1e-6)
    sum_ = tree.sqrt(cosine) + 1.0
    return (vector * tree.math("INVERSE_SQRT", cosine.times_plus(sum_, sum_)),)


# The least product of the squared sines of both angles. In single precision a smaller one has no correct digit.
_SINES_MIN = 1e-6


def dielectric_ior(tree: Tree, ior: Value) -> Value:
    """The index of refraction up to the largest for which the approximation holds."""
    return tree.minimum(ior, IOR_MAX)


def small_slope_over_fresnel(tree: Tree, ior: float, *, light: Direction, view: Direction, one_plus: Value) -> Value:
    """Q over Fresnel's reflectance at the half angle; arguments as in small_slope_reflectance."""

    def formula(inner: Tree, *, one_plus: Value, cos_i: Value, cos_r: Value) -> tuple[Value]:
        less_one = ior**2 - 1
        relative, te = _small_slope(inner, (cos_i, cos_r), one_plus=one_plus, less_one=less_one)
        cosine2 = one_plus * 0.5
        cosine = inner.sqrt(cosine2)
        inside = inner.sqrt(cosine2 + less_one)
        more = inside - cosine
        # Fresnel's reflectance is (more^2 / less_one)^2 (1 + tm^2) / 2, with the amplitude tm of TM over that of TE.
        tm = (cosine.times_plus(inside, cosine2) - 1.0) / cosine.times_plus(more, 1.0)
        return (relative * inner.squared(te / inner.squared(more)) / tm.times_plus(tm, 1.0),)

    given = _angles(light, view, one_plus)
    return by_group(tree, "Small Slope over Fresnel", formula, given=given, gives={"Q over R": "Float"}, of=f"{ior}")[0]


def small_slope_reflectance(tree: Tree, ior: Value, *, light: Direction, view: Direction, one_plus: Value) -> Value:
    """Q for unit vectors to the light and to the viewer; `one_plus` is 1 plus their scalar product."""

    def formula(inner: Tree, *, one_plus: Value, cos_i: Value, cos_r: Value, ior: Value) -> tuple[Value]:
        less_one = ior.times_plus(ior, -1.0)
        relative, te = _small_slope(inner, (cos_i, cos_r), one_plus=one_plus, less_one=less_one)
        return (relative * inner.squared(te / less_one) * 0.5,)

    given = _angles(light, view, one_plus) | {"ior": ior}
    return by_group(tree, "Small Slope Reflectance", formula, given=given, gives={"Q": "Float"})[0]


def _angles(light: Direction, view: Direction, one_plus: Value) -> dict[str, Value]:
    return {"cos_i": light.cosine, "cos_r": view.cosine, "one_plus": one_plus}


def _small_slope(
    tree: Tree, cosines: tuple[Value, Value], *, one_plus: Value, less_one: Value | float
) -> tuple[Value, Value]:
    """Q relative to that of TE to TE in the plane of incidence; and te, by which that is (te / less_one)^2 / 2.

    `less_one` is the permittivity n^2 less 1. On each side there is a cosine c, and inside c' = sqrt(c^2 + less_one).
    With d = c' - c, the amplitude of TE has the factor 1 / (c + c') = d / less_one, and that of TM over it the factor
    (c + c') / (n^2 c + c') = 1 / (1 + c d)."""
    cosines2 = [tree.squared(cosine) for cosine in cosines]
    inside = [tree.sqrt(cosine2 + less_one) for cosine2 in cosines2]
    more = [within - cosine for within, cosine in zip(inside, cosines, strict=True)]
    factors = [1.0 / cosine.times_plus(each, 1.0) for cosine, each in zip(cosines, more, strict=True)]
    # The ratio of TM to TE has its factor of the vector along the surface, or across.
    first, second = (within * factor for within, factor in zip(inside, factors, strict=True))
    crossed = first.times_plus(first, tree.squared(second))
    along = one_plus - cosines[0].times_plus(cosines[1], 1.0)
    sines = tree.maximum((1.0 - cosines2[0]) * (1.0 - cosines2[1]), _SINES_MIN)
    across = factors[0] * factors[1] * sines
    tm_tm = (first * second).times_plus(along, across.times_plus(less_one, across))
    # along^2 / sines is the squared cosine of the azimuth between the directions.
    same = tree.squared(along).times_plus(1.0 - crossed, tree.squared(tm_tm))
    return same / sines + crossed, more[0] * more[1]


def shown_rgb(tree: Tree, rgb_from_xyz: np.ndarray, xyz: Value) -> Value:
    """Linear RGB of a colour in XYZ, by a matrix (3, 3). A colour with negative components is moved towards the grey of
    the same luminance."""
    rows = rgb_from_xyz.tolist()

    def formula(inner: Tree, xyz: Value) -> tuple[Value]:
        components = [inner.dot(xyz, (x, y, z)) for x, y, z in rows]
        y = inner.value(inner.node("ShaderNodeSeparateXYZ", xyz).outputs["Y"])
        return (_kept_in(inner, components, inner.vector(*components), y),)

    return by_group(tree, "XYZ to RGB", formula, given={"xyz": xyz}, gives={"rgb": "Vector"}, of=str(rows))[0]


def shown_under_lamp(tree: Tree, rgb: Value, luminance: Value) -> Value:
    """The same for linear RGB over that of a lamp; `luminance` is the share of each component in the luminance."""
    components = [tree.value(socket) for socket in tree.node("ShaderNodeSeparateXYZ", rgb).outputs]
    return _kept_in(tree, components, rgb, tree.dot(rgb, luminance))


def _kept_in(tree: Tree, components: list[Value], rgb: Value, y: Value) -> Value:
    red, green, blue = components
    y = tree.maximum(y, 0.0)
    lowest = tree.minimum(tree.minimum(red, green), tree.minimum(blue, 0.0))
    # Blender divides by 0 to 0, so a colour of no luminance becomes black.
    share = tree.math("DIVIDE", y, y - lowest)
    return tree.blend(share, y, rgb)


# The label of the nodes that look up a table of lamps begins with this.
LABEL = "Lamp "
# Custom properties of a table of lamps, saved in files: its bakes' light, and what it was made from.
_ILLUMINANT, _CONTENT = "ng_lamps_of", "ng_lamps"
_ROWS = len(lamps_of_table()) + FURTHER_MAX


def lamp_table_image(illuminant: str) -> bpy.types.Image:
    """The file's table of lamps for bakes under an illuminant, in the file's working space; created if needed."""
    for image in bpy.data.images:
        if stored.text(image, _ILLUMINANT) == illuminant and image.library is None and not fault_of(image):
            _renew(image, illuminant)
            return image
    columns = channel_count(illuminant) + 1
    image = bpy.data.images.new("Lamp Spectra", columns, _ROWS, float_buffer=True, is_data=True)
    image.use_half_precision = False
    image[_ILLUMINANT] = illuminant
    _renew(image, illuminant)
    return image


def renew_lamp_tables(groups: Iterable[bpy.types.NodeTree | None]) -> None:
    """Renew the tables of lamps of responses' node groups if lamps have got spectra of other files.

    The pictures stay the same data-blocks, because a handler may call this (workflow/handlers.py)."""
    own = {group: _tables_of(group) for group in filter(None, groups) if group.library is None}
    renewed = {image for image in set().union(*own.values()) if _renew(image, stored.text(image, _ILLUMINANT))}
    for group, images in own.items():
        if images & renewed:
            note_pictures(group)


def _tables_of(group: bpy.types.NodeTree) -> set[bpy.types.Image]:
    """The file's own tables of lamps that a node group looks up."""
    nodes = [node for node in group.nodes if node.type == "TEX_IMAGE" and node.label.startswith(LABEL)]
    found = {node.image for node in nodes if node.image is not None and node.image.library is None}
    return {image for image in found if stored.text(image, _ILLUMINANT)}


def _renew(image: bpy.types.Image, illuminant: str) -> bool:
    """Fill a table if the lamps of the file or its working space have changed. Return whether they have."""
    further, space = further_spectra(), working_space()
    digest = hashlib.sha256("\n".join((illuminant, *further)).encode()).hexdigest()
    content = f"lamps {space} {digest}"
    if stored.text(image, _CONTENT) == content:
        return False
    table = lamp_table(space, illuminant, further)
    if tuple(image.size) != (table.shape[1], _ROWS):  # another version of the extension made it
        return False
    pixels = np.ones((_ROWS, table.shape[1], 4), np.float32)
    pixels[: len(table), :, :3] = table
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    image.update()
    image[_CONTENT] = content
    note_content(image, content)
    return True


class LampColours:
    """The colours of channels under the lamp of a row."""

    def __init__(self, tree: Tree, image: bpy.types.Image, row: Value, triples: int):
        self.tree = tree
        count = 3 * triples + 1
        y = row.times_plus(1 / _ROWS, 0.5 / _ROWS)
        settings = {"image": image, "interpolation": "Closest", "extension": "EXTEND"}
        columns = []
        for column in range(count):
            place = tree.vector((column + 0.5) / count, y, 0.0)
            node = tree.node("ShaderNodeTexImage", place, label=f"{LABEL}{column}", **settings)
            columns.append(tree.value(node.outputs["Color"]))
        *self.columns, self.luminance = columns

    def shown(self, triples: Sequence[Value]) -> Value:
        """Linear RGB over the lamp's own, of channels that come in threes."""
        tree = self.tree
        split = [tree.node("ShaderNodeSeparateXYZ", triple).outputs for triple in triples]
        channels = [tree.value(socket) for sockets in split for socket in sockets]
        rgb = self.columns[0] * channels[0]
        for column, channel in zip(self.columns[1:], channels[1:], strict=True):
            rgb = column.times_plus(channel, rgb)
        return shown_under_lamp(tree, rgb, self.luminance)
