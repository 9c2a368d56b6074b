# SPDX-License-Identifier: GPL-3.0-or-later
"""A whole snake as arrays: points, faces, UVs and attributes.

U runs from the snout to the tail, in units of the largest girth. V runs once around, from the belly's midline over the
side, the back (V = 1/2) and the other side. Seen from outside, (T, B, N) is right-handed: T points to the tail, B to
larger V. Where the tail edge of a scale overhangs the next, U continues around the edge, so no two points of the skin
share a place on the map. Lengths are in metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...precompute.base.failure import GratingError
from .body import SPECIES, Body, Spine, body_along
from .ends import EYE_FACES, Skin, eyes, head_end, tail_end, unwrapped
from .scales import Net, Places, cut_for, make_net, place

# Fewer faces cannot show scales; more would take minutes.
LEAST_FACES, MOST_FACES = 11_000, 1_000_000
# The pale underside of the head and of the tail's end begins at this share of the way from back to belly.
_UNDER = 0.62
# Scales lie looser in bends: their tilts grow by this for each unit of curvature, in 1 / half width.
_LOOSE = 8.0
# Material indices of the faces.
SKIN, EYE = 0, 1


class Detail(NamedTuple):
    """The number of faces; the share (0 to 1) of the body's roundness that each scale of back and sides takes away; the
    scales' random tilts, as a multiple of the species' own; and the seed of these tilts and of the scales' shades.

    On a photograph of Xenopeltis unicolor bands of colour run on along the body over many scales, and bend a little
    with each; in bends single scales flash. So its scales are nearly as round as the body, and hardly tilted except
    in bends."""

    faces: int
    flatness: float = 0.3
    scatter: float = 1.0
    seed: int = 0


@dataclass(frozen=True)
class Shape:
    """A snake with v points, f faces and c corners.

    points    (v, 3) m
    corners   (c,) point of each corner
    starts    (f,) first corner of each face
    uv        (c, 2)
    material  (f,) SKIN or EYE
    edge      (v,) whether a point is on the outer edge of a scale; mesh edges between two of these points are creases
    s         (v,) arc length from the snout, m
    of_points, of_faces   attributes by name, (v,) or (f,), all 0 to 1. Of points: scale_rim, along (snout to tail),
                          around (back to belly), lip (pale lips) and gaze (1 in the middle of an eye's pupil). Of
                          faces: scale_random (one random number per scale) and belly"""

    points: np.ndarray
    corners: np.ndarray
    starts: np.ndarray
    uv: np.ndarray
    material: np.ndarray
    edge: np.ndarray
    s: np.ndarray
    of_points: dict[str, np.ndarray]
    of_faces: dict[str, np.ndarray]


def snake_shape(spine: Spine, species_name: str, detail: Detail) -> Shape:
    """A snake of a species in SPECIES along a spine.

    The number of scales in a row depends on the number of faces. Raises GratingError if that is out of range."""
    if not LEAST_FACES <= detail.faces <= MOST_FACES:
        raise GratingError("snake", f"{detail.faces} faces", f"give {LEAST_FACES} to {MOST_FACES}")
    species = SPECIES[species_name]
    body = body_along(spine, species)
    rows = _Rows(body)
    cut = cut_for(detail.faces - EYE_FACES, species.rows, rows.natural)
    rng = np.random.default_rng(detail.seed)
    net = make_net(species.rows, cut)
    bends = body.bends(rows.arc_lengths(np.arange(-1, cut.scales + 2), cut.scales))
    scatter = detail.scatter * (1 + _LOOSE * np.abs(bends))
    places = place(net, species, flatness=detail.flatness, scatter=scatter, rng=rng)
    return _assemble(body, net, places, rows=rows, rng=rng)


class _Rows:
    """The positions of the scales of a row along the body."""

    def __init__(self, body: Body) -> None:
        first = float(body.scale_lengths(np.array([body.head_end]))[0]) / 2
        self._s = np.linspace(body.head_end - first, body.spine.length - 0.3 * body.radius, 4001)
        self._count = body.scale_counts(self._s)
        self.natural = float(self._count[-1])

    def arc_lengths(self, along: np.ndarray, scales: int) -> np.ndarray:
        """The arc lengths (n,) in metres of scale numbers between -1/2 and `scales` + 1/2."""
        return np.interp((along + 0.5) / (scales + 1) * self.natural, self._count, self._s)


def _assemble(body: Body, net: Net, places: Places, *, rows: _Rows, rng: np.random.Generator) -> Shape:
    scales = net.cut.scales
    s = rows.arc_lengths(places.along, scales)
    unit = body.scale_lengths(s) * rows.natural / (scales + 1)
    no_lip = np.zeros(len(s))
    skin = Skin(s, places.angle, places.rise * unit, places.overhang * unit, places.rim, no_lip, places.inside == 1)
    head = head_end(body, net, skin)
    tail = tail_end(body, net, skin, first=len(s) + len(head.skin.s))
    skin = Skin(*(np.concatenate(parts) for parts in zip(skin, head.skin, tail.skin, strict=True)))
    faces = np.concatenate([net.quads, head.faces, tail.faces])
    numbers = np.concatenate([net.scale, net.scale.max() + 1 + head.plate, tail.plate])
    chance = rng.random(numbers.max() + 1)[numbers]

    girth = 2 * np.pi * body.radius
    tips = (len(s) + len(head.skin.s) - 1, len(skin.s) - 1)
    angle = unwrapped(skin.angle[faces], np.isin(faces, tips))
    uv = np.stack([skin.s[faces] / girth, angle / (2 * np.pi) + 0.5], axis=-1)
    around = np.abs(np.angle(np.exp(1j * skin.angle))) / np.pi
    points = body.points(skin.s + skin.overhang, skin.angle, skin.rise - body.pleats(skin.s, skin.angle))
    eye_points, eye_faces, eye_uv, gaze, eye_s = eyes(body)

    def with_eyes(values: np.ndarray, eye: float = 0.0) -> np.ndarray:
        return np.concatenate([values, np.full(len(eye_points), eye, values.dtype)])

    along = with_eyes(skin.s, eye_s)
    around = with_eyes(around)
    faces = np.concatenate([faces, eye_faces + len(points)])
    uv = np.concatenate([uv, eye_uv])
    real = np.ones(faces.shape, bool)
    real[:, 3] = faces[:, 3] != faces[:, 0]
    return Shape(
        points=np.concatenate([points, eye_points]),
        corners=faces[real],
        starts=np.concatenate([[0], np.cumsum(real.sum(axis=1))[:-1]]),
        uv=uv[real],
        material=np.repeat((SKIN, EYE), (len(faces) - len(eye_faces), len(eye_faces))),
        edge=with_eyes(skin.edge),
        s=along,
        of_points={
            "scale_rim": with_eyes(skin.rim),
            "along": along / body.spine.length,
            "around": around,
            "lip": with_eyes(skin.lip),
            "gaze": np.concatenate([np.zeros(len(points)), gaze]),
        },
        of_faces={
            "scale_random": np.concatenate([chance, np.zeros(len(eye_faces))]),
            "belly": np.concatenate([net.belly, around[faces[len(net.belly) :]].mean(axis=1) > _UNDER]),
        },
    )
