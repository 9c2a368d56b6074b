# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of the BRDF maps in docs/evaluation.md, with the settings from which each map is made."""

from dataclasses import dataclass, field

COHERENCES_UM = (3.25, 6.5, 15, 30, 45, 65)
TAYLOR_TERMS = (0, 1, 4, 9, 10, 39)
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
    of_elaphe = {"flss": "brdfmap__flss_gratings__elaphe", "pq": "brdfmap__flss_pq_elaphe__pq"}
    every = ("reference", "bake", "flss", "chebyshev", "nmm", "nmm-jacobian", "pq", "pq-printed", "stam", "gem")
    return {
        "blaze": method_maps("blaze", every, of_blaze),
        "elaphe": method_maps("elaphe", every, of_elaphe),
        "xenopeltis": method_maps("xenopeltis", ("reference", "bake", "chebyshev"), {}),
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
        "taylor": [
            Map(
                f"taylor-{n}", f"n = 0 to {n}" if n else "n = 0", "elaphe", "flss", {"terms": n + 1},
                thesis=f"brdfmap__flss_elaphe_taylor__{n}",
            )
            for n in TAYLOR_TERMS
        ],
        "half": [
            Map(f"taylor-half-{n}", f"half the height, n = 0 to {n}", "elaphe, half", "flss", {"terms": n + 1})
            for n in (4, 9)
        ],
        "incidence": [
            Map(f"incidence-{surface}-{deg}", f"{surface}, {deg} degrees", surface, "chebyshev", {}, deg)
            for surface in ("blaze", "elaphe")
            for deg in INCIDENCES_DEG
        ],
    }  # fmt: skip
