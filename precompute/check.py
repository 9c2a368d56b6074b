# SPDX-License-Identifier: GPL-3.0-or-later
"""Is a bake what it says it is? Its error, recomputed from its file and the height maps alone.

The table is read and sampled by the few lines here and held against direct sums (direct.py): nothing is shared with
the code that bakes, packs, reads or measures a bake but the figures themselves, the observer's tables and what counts
as the surface.
"""

import hashlib
import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenEXR

from . import direct
from .colour import ILLUMINANTS, WAVELENGTH_MIN_M
from .failure import GratingError
from .figures import Errors, Truth, draw_w, measure
from .height_map import HeightMap
from .relief import Relief, prepare

FORMAT = 5
RINGS = (0.0, 0.1, 0.5, 1.0, 2.0)
# Of the luminance, for a dE00 of 1 or less; in proportion above.
RELATIVE_DY = 0.01
# Another than that of the bake's own check: the same directions would forgive what was tuned to them.
_SEED = 1
_ZERO_ORDER_AT = 17
_HALF_STEP = 2.0**-11
# Texels around a tile that reading alone meets, those that a tile takes of the picture over its texels within, and
# rows under the excess albedo and around it.
_RIM, _TAKEN, _STRIP = 2, 6, 4 + 2
# The bake's expansion of the phasor may be off by so much of the light for a dE00 of 1; a mirror image, all of it in
# one place, is held to the same.
_EXPANSION = 2e-4


@dataclass(frozen=True)
class Table:
    """A bake as its file holds it: terms (K, rows, columns, 3) of XYZ over w^2, row along +v, column along +u, the
    first texel's middle at `first` (u, v), the outer two on every side only met by reading; the zero order's XYZ (n, 3)
    at equal steps of w from 0 to 2; the header. Of its levels the first, under the narrowest kernel."""

    terms: np.ndarray
    zero_order: np.ndarray
    first: tuple[float, float]
    texel: float
    w_range: tuple[float, float]
    sigma_b: float
    illuminant: str
    record: dict

    @property
    def u_range(self) -> tuple[float, float]:
        """From the middle of the first texel that holds the table to the last's."""
        return self.first[0] + _RIM * self.texel, self.first[0] + (self.terms.shape[2] - 1 - _RIM) * self.texel

    @property
    def v_range(self) -> tuple[float, float]:
        return self.first[1] + _RIM * self.texel, self.first[1] + (self.terms.shape[1] - 1 - _RIM) * self.texel

    def scattered_over_w2(self, u: np.ndarray, v: np.ndarray, w: float) -> np.ndarray:
        """Scattered XYZ over w^2 (n, 3) at u, v (n,): B-splines over the texels, and T_k(t) = cos(k arccos t)."""
        low, high = self.w_range
        angle = math.acos(np.clip((2 * w - low - high) / (high - low), -1, 1))
        basis = np.cos(np.arange(len(self.terms)) * angle)
        x = (np.clip(u, *self.u_range) - self.first[0]) / self.texel
        y = (np.clip(v, *self.v_range) - self.first[1]) / self.texel
        found = np.zeros((len(u), 3))
        for row in (np.floor(y) + k for k in (-1, 0, 1, 2)):
            for column in (np.floor(x) + k for k in (-1, 0, 1, 2)):
                share = _bspline(y - row) * _bspline(x - column)
                texels = self.terms[:, row.astype(int), column.astype(int)]
                found += share[:, None] * np.tensordot(basis, texels, axes=1)
        return found

    def zero_order_xyz(self, w) -> np.ndarray:
        """Z (..., 3) at w (...,), B-splines over the samples; past the last they go on in line."""
        last = len(self.zero_order) - 1
        at = np.asarray(w, float) / 2 * last
        beyond = 2 * self.zero_order[-1] - self.zero_order[-2]
        samples = np.concatenate([self.zero_order, [beyond]])
        found = 0.0
        for each in (np.floor(at) + k for k in (-1, 0, 1, 2)):
            found = found + _bspline(at - each)[..., None] * samples[np.clip(each, 0, last + 1).astype(int)]
        return found


def _bspline(x: np.ndarray) -> np.ndarray:
    """The uniform cubic B-spline at x, from its truncated powers."""
    powers = [math.comb(4, k) * (-1) ** k * np.maximum(x + 2 - k, 0) ** 3 for k in range(5)]
    return sum(powers) / 6


@dataclass(frozen=True)
class Verdict:
    """What a check found: the figures, what they may be, and each ring of |u| by itself."""

    errors: Errors
    asked: float
    allowance: float
    zero_order_dy: float
    zero_order_budget: float
    rings: list[dict]
    w: list[float]
    step_m: float
    seconds: float

    @property
    def relative_dy_budget(self) -> float:
        return RELATIVE_DY * max(1.0, self.asked)

    @property
    def faults(self) -> list[str]:
        """What is not as it was asked; empty if the bake passes."""
        found = []
        if not self.errors.p99 <= self.asked + self.allowance:
            found.append(f"dE00 p99 {self.errors.p99:.2f}, asked {self.asked:g}")
        if not self.errors.relative_dy <= self.relative_dy_budget:
            found.append(f"|dY| {self.errors.relative_dy:.1%}, asked {self.relative_dy_budget:.1%}")
        if not self.zero_order_dy <= self.zero_order_budget:
            found.append(f"zero order off by {self.zero_order_dy:.1e}, asked {self.zero_order_budget:.1e}")
        return found

    def as_dict(self) -> dict:
        """Ready for JSON."""
        return {
            "passed": not self.faults,
            "faults": self.faults,
            "asked_delta_e": self.asked,
            "delta_e": self.errors.as_dict(),
            "p99_allowance": self.allowance,
            "relative_dy_budget": self.relative_dy_budget,
            "zero_order": {"dy": self.zero_order_dy, "budget": self.zero_order_budget},
            "rings": self.rings,
            "w": self.w,
            "step_nm": self.step_m * 1e9,
            "seconds": self.seconds,
        }


def check(
    bake: Path,
    height_maps: Sequence[HeightMap],
    delta_e: float | None = None,
    groups: int = 2,
    pairs: int = 4000,
    step_m: float | None = None,
    progress: Callable[[str, float], None] = lambda stage, fraction: None,
) -> Verdict:
    """Recompute a bake's error on `groups` values of w, `pairs` direction pairs each, at a wavelength step.

    delta_e: what was asked, by default as the header says. progress(stage, fraction) as in the bake. Raises
    GratingError if the file is no bake or not one of these height maps."""
    started = time.perf_counter()
    table = read_table(bake)
    _refuse_another_surface(bake, table.record, height_maps)
    asked = float(table.record.get("asked_delta_e", 1.0)) if delta_e is None else delta_e
    step_m = default_step(table.sigma_b) if step_m is None else step_m
    reliefs = [prepare(height_map) for height_map in height_maps]
    truth = truths(table, reliefs, groups, pairs, step_m, progress)
    if not sum(len(t.scattered_xyz) for t in truth):
        raise GratingError(f"{bake}: none of {pairs} direction pairs falls in what it covers; give more --pairs")
    errors = _measured(table, truth)
    w = np.linspace(0, 2, _ZERO_ORDER_AT) + 1 / len(table.zero_order)
    w = w[(w >= table.w_range[0]) & (w <= table.w_range[1])]
    exact = direct.zero_order_xyz(reliefs, w, table.illuminant)[:, 1]
    off = np.abs(table.zero_order_xyz(w)[:, 1] - exact).max(initial=errors.zero_order_dy)
    return Verdict(
        errors, asked, sampling_allowance(errors), float(off), zero_order_budget(reliefs, len(table.zero_order), asked),
        _rings(table, truth), [t.w for t in truth], step_m, time.perf_counter() - started,
    )  # fmt: skip


def read_table(path: Path) -> Table:
    """The table in a bake's file. Raises GratingError if it is none."""
    if not path.is_file():
        raise GratingError(f"{path}: there is no such file; give the .exr that `bake` wrote")
    try:
        file = OpenEXR.File(str(path))
        header, channels = file.header(), file.channels()
    except Exception as error:  # OpenEXR's own type differs by version
        raise GratingError(f"{path}: not a readable OpenEXR file; bake it again") from error
    try:
        record = json.loads(header["natural_gratings"])
        found, model = record["format"], record["model"]
    except (KeyError, TypeError, ValueError) as error:
        raise GratingError(f"{path}: not a Natural Gratings bake; give the .exr that `bake` wrote") from error
    if found != FORMAT:
        raise GratingError(f"{path}: made by another version (format {found}); bake it again")
    if model != "ensemble":
        raise GratingError(f"{path}: holds the {model} model, of which there is no check; bake the ensemble model")
    try:
        return _table(channels["RGB"].pixels[::-1], record)
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        raise GratingError(
            f"{path}: its header and its picture do not agree, or hold what is no number; bake it again"
        ) from error


def _table(image: np.ndarray, record: dict) -> Table:
    """The table in a picture (height, width, 3), row 0 at the bottom. Raises ValueError if the header does not fit."""
    layout = record["layout"]
    rows, columns, across = layout["tile_rows"], layout["tile_columns"], layout["columns"]
    inner = layout["inner_rows"], layout["inner_columns"]
    count, samples = layout["terms"], layout["zero_order_samples"]
    numbers = [layout[name] for name in ("texel", "sigma_b", "scale", "u_first", "v_first", "w_min", "w_max")]
    if not (
        image.shape == (*_picture_size(layout), 3)
        and layout["strip_rows"] == layout["limit_rows"] + _STRIP
        and 1 <= count <= layout["rows"] * across
        and samples >= 2
        and all(1 <= n <= taken - _TAKEN for n, taken in zip(inner, (rows, columns), strict=True))
        and all(math.isfinite(number) for number in numbers)
        and min(numbers[:3]) > 0
        and 0 <= layout["w_min"] < layout["w_max"] <= 2
        and layout["illuminant"] in ILLUMINANTS
        and np.isfinite(image).all()  # of what is no number there is nothing to measure
    ):
        raise ValueError(layout)
    tiles = []
    for k in range(count):
        top, left = layout["strip_rows"] + k // across * rows, k % across * columns
        tiles.append(image[top : top + inner[0] + 2 * _RIM, left : left + inner[1] + 2 * _RIM].astype(np.float32))
    return Table(
        terms=np.stack(tiles) * np.float32(layout["scale"]),
        zero_order=image[0, :samples].astype(float),
        first=(layout["u_first"], layout["v_first"]),
        texel=layout["texel"],
        w_range=(layout["w_min"], layout["w_max"]),
        sigma_b=layout["sigma_b"],
        illuminant=layout["illuminant"],
        record=record,
    )


def _picture_size(layout: dict) -> tuple[int, int]:
    """Height and width of a picture with such a header: beside the first level's tiles, the others' above each
    other."""
    halves = [2**level for level in range(1, layout["levels"])]
    rows, columns = layout["tile_rows"] - _TAKEN, layout["tile_columns"] - _TAKEN
    above = max(rows + _TAKEN, sum(rows // half + _TAKEN for half in halves))
    beside = columns + _TAKEN + sum(columns // half + _TAKEN for half in halves[:1])
    strip = layout["zero_order_samples"] + 1, layout["limit_columns"] + 2
    return layout["strip_rows"] + layout["rows"] * above, max(layout["columns"] * beside, *strip)


def _refuse_another_surface(bake: Path, record: dict, height_maps: Sequence[HeightMap]) -> None:
    told = record.get("heights_sha256", [])
    told = [told] if isinstance(told, str) else told
    if len(told) != len(height_maps):
        raise GratingError(
            f"{bake}: a bake of {len(told)} height maps, not {len(height_maps)}; name them all, in order"
        )
    for digest, height_map in zip(told, height_maps, strict=True):
        if hashlib.sha256(np.ascontiguousarray(height_map.height_m).tobytes()).hexdigest() != digest:
            raise GratingError(
                f"{bake}: a bake of another surface than {height_map.source}; name the file, --size-um, --height-nm "
                "and --channel that it was baked from"
            )
    pixel = record.get("pixel_size_m", height_maps[0].pixel_size_m)
    if not np.allclose(pixel, height_maps[0].pixel_size_m, rtol=1e-6, atol=0):
        raise GratingError(
            f"{bake}: baked from pixels of {pixel[1] * 1e9:.4g} nm; give the --size-um that it was given"
        )


def default_step(sigma_b: float) -> float:
    """Wavelength step in metres: an order at |u| = 1 moves by at most one sigma_b a step, and a Gaussian summed at that
    spacing is flat to 5e-9; from 1 nm, to 3 nm for the observer's sake."""
    return float(np.clip(WAVELENGTH_MIN_M * sigma_b, 1e-9, 3e-9))


def truths(table: Table, reliefs: Sequence[Relief], groups: int, pairs: int, step_m: float, progress) -> list[Truth]:
    """What a table should hold at `groups` values of w, up to `pairs` direction pairs each, within what it covers."""
    rng = np.random.default_rng(_SEED)
    found = []
    for k, w in enumerate(_draw_w(table.w_range, groups, rng)):
        drawn = direct.draw_pairs(reliefs, table.sigma_b, w, pairs, table.u_range, table.v_range, rng)
        scattered = direct.scattered_xyz(
            reliefs, drawn.u, drawn.v, w, table.sigma_b, step_m, table.illuminant,
            lambda fraction, k=k: progress("check", (k + fraction) / groups),
        )  # fmt: skip
        zero_order = direct.zero_order_xyz(reliefs, np.array([w]), table.illuminant)[0]
        found.append(Truth(float(w), drawn, scattered, zero_order))
    return found


def _draw_w(w_range: tuple[float, float], count: int, rng: np.random.Generator) -> np.ndarray:
    """w (count,) as two cosine-weighted directions have it, one from each quantile of what lies in the range."""
    low, high = w_range
    every = np.sort(draw_w(4096, rng))
    inside = every[(every >= low) & (every <= high)]
    if len(inside) < count:
        inside = np.linspace(low, high, 4 * count)
    return inside[((np.arange(count) + rng.random(count)) / count * len(inside)).astype(int)]


def _measured(table: Table, truth: list[Truth]) -> Errors:
    return measure(truth, lambda u, v, w: (table.scattered_over_w2(u, v, w), table.zero_order_xyz(w)), table.illuminant)


def sampling_allowance(errors: Errors) -> float:
    """Two standard deviations of a 99th percentile of that many pairs: sqrt(0.99 0.01 / n) over the density there, that
    of an exponential tail through p95 and p99."""
    tail = (errors.p99 - errors.p95) / math.log(5)
    return 2 * tail * math.sqrt(0.99 * 0.01 / errors.pairs) / 0.01


def zero_order_budget(reliefs: Sequence[Relief], samples: int, asked: float) -> float:
    """The largest |dY| of the zero order: a half float's step, what B-splines over its samples smooth off a curve of
    variance sigma^2 of the heights, |Z''| h^2 / 6 <= (2 pi sigma / lambda)^2 h^2 / 3, and the expansion's tolerance; as
    many times as dE00 is asked above 1."""
    step = 2 / (samples - 1)
    variance = max(np.average(relief.height_m**2, weights=relief.taper**2) for relief in reliefs)
    bend = (2 * np.pi / WAVELENGTH_MIN_M) ** 2 * variance * step**2 / 3
    return max(1.0, asked) * float(_HALF_STEP + bend + _EXPANSION)


def _rings(table: Table, truth: list[Truth]) -> list[dict]:
    """Of each ring of sqrt(u^2 + v^2): its pairs, its share of the light, and |dY| relative to that."""
    parts = [[_in_ring(t, low, high) for t in truth] for low, high in zip(RINGS, RINGS[1:], strict=False)]
    light = [sum(float(t.pairs.radiance_factor() @ t.scattered_xyz[:, 1]) / t.w**2 for t in part) for part in parts]
    found = []
    for low, high, part, lit in zip(RINGS, RINGS[1:], parts, light, strict=False):
        pairs = sum(len(t.scattered_xyz) for t in part)
        found.append({
            "u_from": low, "u_to": high, "pairs": pairs, "light": lit / max(sum(light), np.finfo(float).tiny),
            "relative_dy": _measured(table, part).relative_dy if pairs else 0.0,
        })  # fmt: skip
    return found


def _in_ring(truth: Truth, low: float, high: float) -> Truth:
    radius = np.hypot(truth.pairs.u, truth.pairs.v)
    kept = (radius >= low) & (radius < high)
    return Truth(truth.w, truth.pairs.only(kept), truth.scattered_xyz[kept], truth.zero_order_xyz)
