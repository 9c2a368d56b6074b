# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of the BRDF maps in docs/evaluation.md, with the settings from which each map is made."""

from dataclasses import dataclass, field

import numpy as np

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
            f"taylor-{surface}-{n}", f"n = 0 to {n}" if n else "n = 0", f"{surface}, cut", "flss-about-mean",
            {"terms": n + 1, "dtype": np.float64}, thesis=f"{thesis}{n}",
            # Beside the dot of n = 0 there is nothing but rounding errors.
            percentile=99.5 if n else 100,
        )
        for n in TAYLOR_TERMS[surface]
    ]  # fmt: skip
