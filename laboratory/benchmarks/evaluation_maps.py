# SPDX-License-Identifier: GPL-3.0-or-later
"""The BRDF maps of docs/evaluation.md, with the settings from which each map is made; the page's surfaces, the
thesis's scans where they are, sample surfaces in their place where not; and how well the maps agree with the thesis's
pictures."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from PIL import Image

from precompute.methods.flss import Taylor
from precompute.methods.method import Settings
from precompute.methods.windowed_images import WindowedImages, windowed
from precompute.surface.height_map import HeightMap
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import Relief, prepare
from precompute.surface.samples.ruled_gratings import blazed

from ..speed.surfaces import SKINS, skin

PIXELS = 256
COHERENCES_UM = (3.25, 6.5, 15, 30, 45, 65)
TAYLOR_TERMS = {"elaphe": (0, 1, 4, 9, 10, 39), "xenopeltis": (0, 1, 3, 23, 25, 39)}
STEPS_NM = (5, 10, 50)
INCIDENCES_DEG = (0, 10, 20)


@dataclass(frozen=True)
class Map:
    """One BRDF map of the page: the stem of its file, its caption, and the surface, method and settings that make it.

    `thesis` is the name of the thesis's picture of the same map, if there is one."""

    name: str
    caption: str
    surface: str
    method: str
    changes: dict = field(default_factory=dict)
    theta_i_deg: float = 0
    thesis: str = ""
    percentile: float = 99.5


def method_maps(surface: str, methods: tuple[str, ...], thesis: dict[str, str], **changes) -> list[Map]:
    """The maps of one surface by several methods."""
    return [Map(f"{surface}-{name}", name, surface, name, changes, 0, thesis.get(name, "")) for name in methods]


def groups() -> dict[str, list[Map]]:
    """Every map of the page, by section."""
    approaches = "brdfmap__approaches_blazed__"
    of_blaze = {name: approaches + name for name in ("flss", "nmm", "gem")}
    of_blaze |= {"pq": approaches + "pqsinc", "pq-printed": approaches + "pq"}
    of_elaphe = {"pq": "brdfmap__flss_pq_elaphe__pq"}
    every = ("reference", "bake", "flss", "chebyshev", "nmm", "nmm-jacobian", "pq", "pq-printed", "stam", "gem")
    return {
        "blaze": method_maps("blaze", every, of_blaze),
        "elaphe": [*method_maps("elaphe", every, of_elaphe), cut_map("elaphe", "flss_gratings__elaphe")],
        "xenopeltis": [
            *method_maps("xenopeltis", ("reference", "bake", "chebyshev"), {}),
            cut_map("xenopeltis", "flss_gratings__xeno"),
        ],
        "coherence": [
            Map(
                f"coherence-{um:g}".replace(".", "_"), f"{um:g} um", f"blaze of {max(1, round(um / 2.5))}", "flss",
                {"coherence_length_m": um * 1e-6, "texels": 5},
                thesis="brdfmap__flss_blazed_sigmas__" + f"{um:g}".replace(".", "_"),
                percentile=97,
            )
            for um in COHERENCES_UM
        ],
        "steps": [
            Map(
                f"step-{nm}", f"{nm} nm", "elaphe", "flss", {"step_m": nm * 1e-9},
                thesis="" if nm == 10 else f"brdfmap__flss_elaphe_lambdasteps__{nm}",
            )
            for nm in STEPS_NM
        ],
        **{f"taylor-{surface}": taylor_maps(surface) for surface in TAYLOR_TERMS},
        "incidence": [
            Map(f"incidence-{surface}-{deg}", f"{surface}, {deg} degrees", surface, "chebyshev", {}, deg)
            for surface in ("blaze", "elaphe")
            for deg in INCIDENCES_DEG
        ],
        "incidence-xenopeltis": [
            Map(
                f"incidence-xenopeltis-{method}-{deg}", f"{shown}, {deg} degrees", "xenopeltis, cut", method, changes,
                deg,
                thesis=f"brdfmap__{shown}_xeno_thetai__{deg}",
            )
            for method, shown, changes in (("chebyshev", "flss", {}), ("pq", "pq", {"centred": True}))
            for deg in INCIDENCES_DEG
        ],
    }  # fmt: skip


def cut_map(surface: str, thesis: str) -> Map:
    """A skin that is cut as the thesis cuts it, by FLSS over Chebyshev images."""
    thesis = f"brdfmap__{thesis}"
    return Map(f"{surface}-cut", "flss, cut as the thesis", f"{surface}, cut", "chebyshev", thesis=thesis)


def taylor_maps(surface: str) -> list[Map]:
    """FLSS over a few of Taylor's terms about the mean height, on a skin that is cut as the thesis cuts it."""
    thesis = "brdfmap__flss_" + {"elaphe": "elaphe", "xenopeltis": "xeno"}[surface] + "_taylor__"
    return [
        Map(
            f"taylor-{surface}-{n}", f"n ≤ {n}", f"{surface}, cut", "flss-about-mean",
            {"terms": n + 1, "dtype": np.float64}, thesis=f"{thesis}{n}",
            # Beside the dot of n = 0 there is nothing but rounding errors.
            percentile=99.5 if n else 100,
        )
        for n in TAYLOR_TERMS[surface]
    ]  # fmt: skip


def height_maps(shared: Path) -> dict[str, HeightMap]:
    """The surfaces by name; "elaphe" and "xenopeltis" are the scans where the folder has them.

    The blazes of few periods are the same endless surface cut into a smaller patch. They are for short coherence
    lengths, because FLSS reads only a few texels around a frequency."""
    surfaces = {"blaze": read_height_map("sample:blazed"), **{name: skin(shared, name) for name in SKINS}}
    for um in COHERENCES_UM:
        periods = max(1, round(um / 2.5))
        surfaces[f"blaze of {periods}"] = blazed(periods=periods, rows=32 * periods)
    return surfaces


def reliefs(surfaces: dict[str, HeightMap]) -> dict[str, Relief]:
    """A relief for each surface, and another one for each skin, cut as the thesis cuts it ("elaphe, cut")."""
    prepared = {name: prepare(surface) for name, surface in surfaces.items()}
    return prepared | {f"{name}, cut": as_the_thesis_cuts(surfaces[name]) for name in SKINS}


def as_the_thesis_cuts(height_map: HeightMap) -> Relief:
    """The heights as they were measured, counted from their mean: no levelling and no apodisation. The coherence window
    is centred on the patch's corner, where its edges meet.

    The thesis does not tell this; its pictures and its table do (docs/evaluation.md)."""
    raw = prepare(replace(height_map, periodic=True))
    middle = tuple(n // 2 for n in raw.height_m.shape)
    return replace(raw, periodic=height_map.periodic, height_m=np.roll(raw.height_m, middle, (0, 1)))


def flss_about_mean(relief: Relief, settings: Settings) -> WindowedImages:
    """FLSS with settings.terms terms of Taylor's series about the relief's mean height, which is its zero."""
    expansion = Taylor(settings.terms, 0.0, float(np.abs(relief.height_m).max()))
    return windowed("flss", relief, expansion, settings=settings)


# The share of a thesis's picture, from its edge, at which the disc of views begins: 19 of 800 pixels.
DISC_MARGIN = 19 / 800
# Agreement is taken between these distances from the normal: the middle of the disc clips, and its edge is drawn in
# white.
RING = (0.1, 0.95)


@dataclass(frozen=True)
class Agreement:
    """Rank correlations of a map with the thesis's picture, in red, green and blue, as it is and turned by half a
    turn."""

    name: str
    caption: str
    thesis: str
    upright: list[float]
    turned: list[float]


def agreements(wanted: dict[str, list[Map]], images: Path, shared: Path) -> list[Agreement]:
    """The agreement of every map of a skin that shows something beside its specular middle with the thesis's."""
    skins = ("elaphe", "xenopeltis", "taylor-elaphe", "taylor-xenopeltis", "incidence-xenopeltis")
    found = []
    for one in (one for name in skins for one in wanted[name]):
        path = shared / "thesis_figures" / f"{one.thesis}.png"
        if not one.thesis or not path.is_file() or one.changes.get("terms") == 1:
            continue
        ours = np.asarray(Image.open(images / f"{one.name}.png").convert("RGB"))
        theirs = np.asarray(disc(path, len(ours)))
        turned = ours[::-1, ::-1]
        found.append(
            Agreement(one.name, one.caption, one.thesis, agreement(ours, theirs), agreement(turned, theirs))
        )  # fmt: skip
    return found


def agreement(ours: np.ndarray, theirs: np.ndarray) -> list[float]:
    """Spearman's rank correlation of two maps (n, n, 3), for each channel.

    Ranks do not depend on exposure or gamma, which the thesis does not tell. The left half of the ring RING is taken,
    because some of the thesis's pictures hold an inset in the right half."""
    axis = (np.arange(len(ours)) + 0.5) * 2 / len(ours) - 1
    x, y = np.meshgrid(axis, axis)
    radius = np.hypot(x, y)
    inside = (radius > RING[0]) & (radius < RING[1]) & (x < 0)
    pairs = ((ranks(ours[inside, c]), ranks(theirs[inside, c])) for c in range(3))
    return [float(np.corrcoef(*pair)[0, 1]) for pair in pairs]


def ranks(values: np.ndarray) -> np.ndarray:
    """The rank of each of the values (n,); equal values share the mean of their ranks."""
    _, which, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2)[which.ravel()]


def disc(path: Path, pixels: int) -> Image.Image:
    """The disc of views of a picture of the thesis, over white, resized to a square."""
    picture = Image.open(path).convert("RGBA")
    white = Image.new("RGBA", picture.size, "white")
    white.alpha_composite(picture)
    margin = round(DISC_MARGIN * picture.width)
    inner = white.convert("RGB").crop((margin, margin, picture.width - margin, picture.height - margin))
    return inner.resize((pixels, pixels), Image.Resampling.BOX)
