# SPDX-License-Identifier: GPL-3.0-or-later
"""Synthetic surfaces, usable as "sample:NAME" wherever a file is: exact, seeded, and wrapping at the edges.

All are HeightMap with periodic=True and a whole number of periods along each axis. Heights vary along the
columns (the tangent T) unless a surface says otherwise, so that T is the direction of the grating vector.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .failure import GratingError
from .height_map import HeightMap

_SAMPLES_PER_PERIOD = 32
_PERIODS = 26
_PERIOD_M = 2.5e-6


def flat() -> HeightMap:
    """A mirror: 256 x 256 zeros over 65 um."""
    return _sample("flat", np.zeros((256, 256)), 65e-6 / 256)


def sinusoidal(
    period_m: float = _PERIOD_M,
    depth_m: float = 200e-9,
    *,
    periods: int = _PERIODS,
    samples_per_period: int = _SAMPLES_PER_PERIOD,
    rows: int = _PERIODS * _SAMPLES_PER_PERIOD,
) -> HeightMap:
    """h = depth/2 sin(2 pi x / period), depth from trough to crest."""
    phase = np.arange(samples_per_period) / samples_per_period
    return _grating("sinusoidal", depth_m / 2 * np.sin(2 * np.pi * phase), period_m, periods, rows)


def binary(
    period_m: float = _PERIOD_M,
    depth_m: float = 140e-9,
    *,
    duty: float = 0.5,
    periods: int = _PERIODS,
    samples_per_period: int = _SAMPLES_PER_PERIOD,
    rows: int = _PERIODS * _SAMPLES_PER_PERIOD,
) -> HeightMap:
    """Ridges of height depth over a floor of 0; duty is the ridges' share, rounded to whole samples."""
    ridge = np.arange(samples_per_period) < round(duty * samples_per_period)
    return _grating("binary", np.where(ridge, depth_m, 0.0), period_m, periods, rows)


def blazed(
    period_m: float = _PERIOD_M,
    depth_m: float = 246.23e-9,
    *,
    periods: int = _PERIODS,
    samples_per_period: int = _SAMPLES_PER_PERIOD,
    rows: int = _PERIODS * _SAMPLES_PER_PERIOD,
) -> HeightMap:
    """Facets that rise along +T with the slope depth/period, and drop between two samples.

    The samples of a facet are j depth / samples_per_period, so that their own range is one step less than depth.
    """
    ramp = depth_m * np.arange(samples_per_period) / samples_per_period
    return _grating("blazed", ramp, period_m, periods, rows)


def elaphe() -> HeightMap:
    """Like the shed skin of Elaphe guttata: rows of long fingers 1144 nm apart along T, 375 nm from peak to peak.

    Not a copy of a scan: the irregularities are drawn at random, to the measured strength of a real one (about
    25 nm rms in the first order, fingers 3.1 um long, slow waves of 20 nm rms, some grains of dust).
    """
    return _skin(
        "elaphe",
        _Skin(
            seed=1144,
            side_m=57 * 1144e-9,
            fingers=(21, 57),
            relief_m=375e-9,
            finger_m=80e-9,
            rise_m=16e-9,
            floor_m=-52e-9,
            tip_width=0.17,
            base_width=0.66,
            stagger=0.13,
            drift=(0.4, 0.5),
            uneven=0.15,
            waves_m=(16e-9, 13e-9),
            grains=14,
            grain_m=260e-9,
        ),
    )


def xenopeltis() -> HeightMap:
    """Like the shed skin of Xenopeltis unicolor: short, dense fingers in straight rows 1552 nm apart.

    The strong period lies along the fingers, across the rows, so its grating vector points along B; 818.69 nm
    from peak to peak.
    """
    return _skin(
        "xenopeltis",
        _Skin(
            seed=1552,
            side_m=42 * 1552e-9,
            fingers=(42, 116),
            relief_m=818.69e-9,
            finger_m=95e-9,
            rise_m=60e-9,
            floor_m=200e-9,
            tip_width=0.25,
            base_width=0.62,
            stagger=0.05,
            drift=(0.1, 0.7),
            uneven=0.15,
            waves_m=(60e-9, 25e-9),
            grains=0,
            grain_m=0.0,
        ),
    )


def cd() -> HeightMap:
    """Compact disc: tracks along B 1.6 um apart, pits 0.5 um wide, 110 nm deep and 0.83 to 3.05 um long."""
    return _disc(
        "cd",
        _Disc(
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
        _Disc(
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
        _Disc(
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


SAMPLES: dict[str, Callable[[], HeightMap]] = {
    make.__name__: make for make in (flat, sinusoidal, binary, blazed, elaphe, xenopeltis, cd, dvd, bluray)
}


def make_sample(name: str) -> HeightMap:
    """The surface of that name, always the same one. Raises GratingError where there is none."""
    if name not in SAMPLES:
        raise GratingError(f"sample:{name}: there is no such sample; choose one of {', '.join(SAMPLES)}")
    return SAMPLES[name]()


def _sample(name: str, height_m: np.ndarray, pixel_m: float) -> HeightMap:
    return HeightMap(height_m, (pixel_m, pixel_m), f"sample:{name}", periodic=True)


def _grating(name: str, profile_m: np.ndarray, period_m: float, periods: int, rows: int) -> HeightMap:
    """One period's profile, repeated along the columns, the same in every row."""
    height = np.broadcast_to(np.tile(profile_m, periods), (rows, periods * len(profile_m)))
    return _sample(name, height.copy(), period_m / len(profile_m))


@dataclass(frozen=True)
class _Disc:
    seed: int
    pitch_m: float
    tracks: int
    samples_per_pitch: int
    width_m: float
    depth_m: float
    channel_bit_m: float
    runs: tuple[int, int]  # shortest and longest pit or land, in channel bits
    edge_m: float  # from the land to the floor of a pit


def _disc(name: str, disc: _Disc) -> HeightMap:
    """Pits below a land of height 0, on a square of a whole number of tracks."""
    rng = np.random.default_rng(disc.seed)
    pixel_m = disc.pitch_m / disc.samples_per_pitch
    side_m = disc.tracks * disc.pitch_m
    position = np.arange(disc.tracks * disc.samples_per_pitch) * pixel_m
    groove = np.array([[-disc.width_m / 2, disc.width_m / 2]])
    across = _trapezoid(position, groove, disc.edge_m, disc.pitch_m)
    along = np.stack(
        [_trapezoid(position, _pits(rng, disc, side_m), disc.edge_m, side_m) for _ in range(disc.tracks)], axis=1
    )
    # A track's pixels are those nearest to its middle.
    track = np.round(position / disc.pitch_m).astype(int) % disc.tracks
    return _sample(name, -disc.depth_m * along[:, track] * across, pixel_m)


def _pits(rng: np.random.Generator, disc: _Disc, length_m: float) -> np.ndarray:
    """(n, 2) begin and end of each pit along a track that closes on itself after length_m."""
    bits = round(length_m / disc.channel_bit_m)
    shortest, longest = disc.runs
    lengths = np.arange(shortest, longest + 1)
    # Eight-to-fourteen modulation makes short runs the likelier ones, by about this ratio a channel bit.
    chance = 0.7**lengths
    runs: list[int] = []
    while (left := bits - sum(runs)) > 2 * longest:
        runs.append(int(rng.choice(lengths, p=chance / chance.sum())))
    # Pits and lands alternate round the ring, so that there must be an even number of them: two or three more.
    parts = 2 + len(runs) % 2
    runs += [(left + part) // parts for part in range(parts)]
    edges = np.concatenate([[0], np.cumsum(runs)[:-1]]) + rng.integers(bits)
    return edges.reshape(-1, 2) * (length_m / bits)


def _trapezoid(position: np.ndarray, spans: np.ndarray, edge: float, period: float) -> np.ndarray:
    """1 within the spans and 0 outside, with linear edges centred on their ends, repeated with the period."""
    corners = np.stack(
        [spans[:, 0] - edge / 2, spans[:, 0] + edge / 2, spans[:, 1] - edge / 2, spans[:, 1] + edge / 2], axis=1
    )
    levels = np.broadcast_to([0.0, 1.0, 1.0, 0.0], corners.shape)
    return np.interp(position, corners.ravel(), levels.ravel(), period=period)


@dataclass(frozen=True)
class _Skin:
    seed: int
    side_m: float
    fingers: tuple[int, int]  # rows of fingers, fingers in a row
    relief_m: float  # of the whole, from peak to peak
    finger_m: float  # height of a finger's ridge over the floor beside its tip
    rise_m: float  # of the ridge from tip to base
    floor_m: float  # rise of the floor from tip to base
    tip_width: float  # half widths of a finger, in pitches
    base_width: float
    stagger: float  # rms shift of a finger's ends against its neighbours', in rows
    drift: tuple[float, float]  # rms wander of the row lines and of the fingers' axes, in pitches
    uneven: float  # rms of the fingers' heights, as a fraction
    waves_m: tuple[float, float]  # rms of the long and of the shorter waves under it all
    grains: int  # of dust
    grain_m: float


def _skin(name: str, skin: _Skin) -> HeightMap:
    """Rows of fingers that point to the top of the scan, on an uneven ground; 800 pixels a side.

    A finger starts as a narrow tip on the base of the row above it and widens until it meets its neighbours;
    the floor beside it rises or sinks meanwhile, and both end in a step at the next row's line.
    """
    rng = np.random.default_rng(skin.seed)
    shape = (800, 800)
    y, x = np.arange(shape[0])[:, None] / shape[0], np.arange(shape[1]) / shape[1]
    lane = skin.fingers[1] * x + skin.drift[1] * _noise(rng, shape, (0.30, 0.06))
    row = (
        skin.fingers[0] * y
        + skin.drift[0] * _noise(rng, shape, (0.20, 0.08))
        + skin.stagger * _noise(rng, shape, (0.05, 0.5 / skin.fingers[1]))
    )
    along = row % 1
    own = np.floor(row).astype(int) % skin.fingers[0], np.round(lane).astype(int) % skin.fingers[1]
    height = 1 + skin.uneven * rng.standard_normal(skin.fingers)[own]
    half_width = skin.tip_width + (skin.base_width - skin.tip_width) * along**1.5
    aside = np.minimum(np.abs(lane - np.round(lane)) / half_width, 1)
    ridge = (skin.finger_m + skin.rise_m * along) * height * np.cos(np.pi / 2 * aside) ** 2
    floor = skin.floor_m * along**2
    relief = (
        _blur(ridge + floor, 0.6)
        + skin.waves_m[0] * _noise(rng, shape, (0.14, 0.14))
        + skin.waves_m[1] * _noise(rng, shape, (0.04, 0.03))
        + _dust(rng, shape, skin.grains, skin.grain_m)
    )
    relief -= relief.min()
    return _sample(name, relief * (skin.relief_m / relief.max()), skin.side_m / shape[1])


def _noise(rng: np.random.Generator, shape: tuple[int, int], correlation: tuple[float, float]) -> np.ndarray:
    """Periodic noise of mean 0 and rms 1, smooth over the given fractions of the sides (rows, cols)."""
    sigma = correlation[0] * shape[0], correlation[1] * shape[1]
    noise = _blur(rng.standard_normal(shape), sigma)
    noise -= noise.mean()
    return noise / noise.std()


def _blur(values: np.ndarray, sigma: float | tuple[float, float]) -> np.ndarray:
    """Periodic convolution with a Gaussian of standard deviation sigma pixels along (rows, cols)."""
    sigma_y, sigma_x = np.broadcast_to(sigma, 2)
    y = np.exp(-2 * (np.pi * sigma_y * np.fft.fftfreq(values.shape[0])) ** 2)
    x = np.exp(-2 * (np.pi * sigma_x * np.fft.rfftfreq(values.shape[1])) ** 2)
    return np.fft.irfft2(np.fft.rfft2(values) * y[:, None] * x, s=values.shape)


def _dust(rng: np.random.Generator, shape: tuple[int, int], count: int, height_m: float) -> np.ndarray:
    """Round grains a few pixels wide, the highest of height_m."""
    dust = np.zeros(shape)
    if count:
        places = rng.integers(shape[0], size=count), rng.integers(shape[1], size=count)
        dust[places] = rng.uniform(0.1, 1, count)
        dust = _blur(dust, 2.5)
        dust *= height_m / dust.max()
    return dust
