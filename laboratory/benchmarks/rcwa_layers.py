# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigorous coupled waves for gratings under films that follow the relief, with light in the plane of incidence.

Each film has the same vertical thickness everywhere: its upper face is the relief shifted up. For small slopes this is
the model of the bakes, which take the reflectance of flat films. Lengths are in wavelengths.

The relief is a staircase of PARTS equal columns per period, sampled as in rcwa.py. A slice is a range of heights in
which no column changes its matter. In a slice the fields of order m vary as exp(2 pi i (k_m x + q z)), with
k_m = sin(theta) + m / period. q^2 and the modes are the eigenvalues and eigenvectors of

    TE, with E along the grooves:   [e] - K^2
    TM, with H along the grooves:   [1/e]^-1 (1 - K [e]^-1 K)

[e] is the Toeplitz matrix of the Fourier series of the permittivity e, and K the diagonal matrix of k_m (Moharam and
Gaylord 1981, with the factorisation of Li 1996). The reflection matrix is carried from the substrate upwards through
the slices. It multiplies by exp(2 pi i q thickness) only, so no film is too thick.
"""

from dataclasses import dataclass

import numpy as np

from ..study.efficiency import profile
from .rcwa import EXTRA_ORDERS, PARTS, Grating


@dataclass(frozen=True)
class Modes:
    """The modes of a slice: their fields along the grooves (n, n) and across them (n, n), and q (n,)."""

    along: np.ndarray
    across: np.ndarray
    q: np.ndarray


def slices(case: Grating, parts: int) -> list[tuple[float, np.ndarray]]:
    """(thickness, permittivities (parts,)) of each slice from the lowest up."""
    indices = np.array([1, *(index for index, _ in case.films), case.index], dtype=complex)
    # The heights of the faces over the relief: the substrate's, then each film's upper face.
    faces = np.cumsum([0.0, *(thickness for _, thickness in reversed(case.films))])
    heights = np.round(faces[:, None] + profile(case.kind, case.depth, parts, duty=case.duty), 12)
    levels = np.unique(heights)
    found = []
    for low, high in zip(levels, levels[1:], strict=False):
        below = np.sum(heights > low, axis=0)  # how many faces are above the slice in each column
        found.append((float(high - low), indices[below] ** 2))
    return found


def reflected(case: Grating, parts: int = PARTS, extra: int = EXTRA_ORDERS) -> np.ndarray:
    """Powers (2, orders + 1) of TE and TM over the incident power: reflected orders -n to n, then transmission.

    The transmission has no meaning in a substrate that absorbs."""
    most = int(np.ceil(max(abs(index) for index in (case.index, *_film_indices(case))) * case.period)) + extra
    k = np.sin(np.radians(case.theta_deg)) + np.arange(-most, most + 1) / case.period
    stack = slices(case, parts)
    return np.array([_powers(k, stack, complex(case.index) ** 2, te=te) for te in (True, False)])


def _film_indices(case: Grating) -> list[complex]:
    """The indices of films that do not absorb: waves travel in these at all."""
    return [index for index, _ in case.films if complex(index).imag == 0]


def _powers(k: np.ndarray, stack: list[tuple[float, np.ndarray]], substrate: complex, *, te: bool) -> np.ndarray:
    """Reflected orders and transmission (orders + 1,) of one polarisation over the incident power."""
    air, lower = _uniform(k, 1, te=te), _uniform(k, substrate, te=te)
    identity = np.eye(len(k))
    reflection, transmission, below = np.zeros_like(identity), identity, lower
    for thickness, permittivities in [*stack, (0.0, None)]:
        modes = air if permittivities is None else _modes(k, permittivities, te=te)
        total = below.along @ (identity + reflection)
        admittance = below.across @ (identity - reflection) @ np.linalg.inv(total)
        down, up = np.linalg.inv(modes.along), np.linalg.solve(modes.across, admittance)
        reflection = (down - up) @ np.linalg.inv(down + up)
        turn = np.exp(2j * np.pi * modes.q * thickness)
        step = np.linalg.solve(total, modes.along @ (identity + reflection) * turn)
        transmission, reflection = transmission @ step, turn[:, None] * reflection * turn
        below = modes
    incident = len(k) // 2
    flux = air.across.diagonal().real
    back = np.abs(reflection[:, incident]) ** 2 * flux
    through = np.abs(transmission[:, incident]) ** 2 * lower.across.diagonal().real
    return np.append(back, through.sum()) / flux[incident]


def _uniform(k: np.ndarray, permittivity: complex, *, te: bool) -> Modes:
    """The plane waves of a uniform matter."""
    q = _root(permittivity - k**2)
    return Modes(np.eye(len(k)), np.diag(q if te else q / permittivity), q)


def _modes(k: np.ndarray, permittivities: np.ndarray, *, te: bool) -> Modes:
    """The modes of a slice whose columns have these permittivities (parts,)."""
    if np.all(permittivities == permittivities[0]):
        return _uniform(k, permittivities[0], te=te)
    series = _series(permittivities, len(k))
    if te:
        squares, along = np.linalg.eig(series - np.diag(k**2))
        q = _root(squares)
        return Modes(along, along * q, q)
    inverse = _series(1 / permittivities, len(k))
    curl = np.eye(len(k)) - k[:, None] * np.linalg.inv(series) * k
    squares, along = np.linalg.eig(np.linalg.solve(inverse, curl))
    q = _root(squares)
    return Modes(along, inverse @ along * q, q)


def _root(squares: np.ndarray) -> np.ndarray:
    """The root that decays downwards or travels down. Rounding gives a travelling wave a small imaginary part of either
    sign; with the other root it would travel up, and its reflection would be a division by nearly 0."""
    q = np.sqrt(squares + 0j)
    return np.where(q.real + q.imag < 0, -q, q)


def _series(values: np.ndarray, orders: int) -> np.ndarray:
    """The Toeplitz matrix (orders, orders) of the Fourier series of equal columns with these values (parts,)."""
    parts = len(values)
    order = np.arange(-orders + 1, orders)
    centres = (np.arange(parts) + 0.5) / parts
    terms = np.exp(-2j * np.pi * np.outer(order, centres)) @ values * np.sinc(order / parts) / parts
    row = np.arange(orders)
    return terms[row[:, None] - row + orders - 1]
