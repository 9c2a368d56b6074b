# SPDX-License-Identifier: GPL-3.0-or-later
"""Optical discs, with pits of random lengths in straight tracks along B."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..height_map import HeightMap
from .ruled_gratings import wrapping_surface


def cd() -> HeightMap:
    """Compact disc: tracks along B 1.6 um apart, pits 0.5 um wide, 110 nm deep and 0.83 to 3.05 um long."""
    return _disc(
        "cd",
        Disc(
            seed=780,
            pitch_m=1.6e-6,
            tracks=40,
            samples_per_pitch=20,
            width_m=0.5e-6,
            depth_m=110e-9,
            channel_bit_m=277.5e-9,
            runs=(3, 11),
            edge_m=80e-9,
        ),
    )


def dvd() -> HeightMap:
    """DVD: tracks along B 0.74 um apart, pits 0.32 um wide, 105 nm deep and 0.40 to 1.87 um long."""
    return _disc(
        "dvd",
        Disc(
            seed=650,
            pitch_m=0.74e-6,
            tracks=88,
            samples_per_pitch=12,
            width_m=0.32e-6,
            depth_m=105e-9,
            channel_bit_m=133.3e-9,
            runs=(3, 14),
            edge_m=60e-9,
        ),
    )


def bluray() -> HeightMap:
    """Blu-ray disc: tracks along B 0.32 um apart, pits 0.13 um wide, 65 nm deep and 0.15 to 0.69 um long."""
    return _disc(
        "bluray",
        Disc(
            seed=405,
            pitch_m=0.32e-6,
            tracks=100,
            samples_per_pitch=8,
            width_m=0.13e-6,
            depth_m=65e-9,
            channel_bit_m=76.7e-9,
            runs=(2, 9),
            edge_m=40e-9,
        ),
    )


@dataclass(frozen=True)
class Disc:
    """The dimensions of a disc; width_m and depth_m are a pit's."""

    seed: int
    pitch_m: float  # distance of neighbouring tracks
    tracks: int
    samples_per_pitch: int
    width_m: float
    depth_m: float
    channel_bit_m: float
    runs: tuple[int, int]  # the shortest and the longest pit or land, in channel bits
    edge_m: float  # width of the slope from the land to the floor of a pit


def _disc(name: str, disc: Disc) -> HeightMap:
    return wrapping_surface(name, disc_heights(disc), disc.pitch_m / disc.samples_per_pitch)


def disc_heights(disc: Disc) -> np.ndarray:
    """Make the heights of a square of a whole number of tracks, in metres: the land is at 0, the pits lie below."""
    rng = np.random.default_rng(disc.seed)
    pixel_m = disc.pitch_m / disc.samples_per_pitch
    side_m = disc.tracks * disc.pitch_m
    position = np.arange(disc.tracks * disc.samples_per_pitch) * pixel_m
    groove = np.array([[-disc.width_m / 2, disc.width_m / 2]])
    across = _trapezoid(position, groove, edge=disc.edge_m, period=disc.pitch_m)
    along = np.stack(
        [_trapezoid(position, _pits(rng, disc, side_m), edge=disc.edge_m, period=side_m) for _ in range(disc.tracks)],
        axis=1,
    )
    # The nearest track of each pixel along T.
    track = np.round(position / disc.pitch_m).astype(int) % disc.tracks
    return -disc.depth_m * along[:, track] * across


def _pits(rng: np.random.Generator, disc: Disc, length_m: float) -> np.ndarray:
    """Draw begin and end (n, 2) in metres of each pit along a track that wraps after length_m."""
    bits = round(length_m / disc.channel_bit_m)
    shortest, longest = disc.runs
    lengths = np.arange(shortest, longest + 1)
    # In eight-to-fourteen modulation a run is about 0.7 times as likely as one that is a channel bit shorter.
    chance = 0.7**lengths
    runs: list[int] = []
    while (left := bits - sum(runs)) > 2 * longest:
        runs.append(int(rng.choice(lengths, p=chance / chance.sum())))
    # Pits and lands alternate around the track, so their number must be even: split the rest in two or three.
    parts = 2 + len(runs) % 2
    runs += [(left + part) // parts for part in range(parts)]
    edges = np.concatenate([[0], np.cumsum(runs)[:-1]]) + rng.integers(bits)
    return edges.reshape(-1, 2) * (length_m / bits)


def _trapezoid(position: np.ndarray, spans: np.ndarray, *, edge: float, period: float) -> np.ndarray:
    """Evaluate a periodic profile at positions (n,): 1 within the spans (m, 2), 0 outside, with linear edges of width
    `edge` centred on the spans' ends."""
    corners = np.stack(
        [spans[:, 0] - edge / 2, spans[:, 0] + edge / 2, spans[:, 1] - edge / 2, spans[:, 1] + edge / 2], axis=1
    )
    levels = np.broadcast_to([0.0, 1.0, 1.0, 0.0], corners.shape)
    return np.interp(position, corners.ravel(), levels.ravel(), period=period)
