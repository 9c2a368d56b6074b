# SPDX-License-Identifier: GPL-3.0-or-later
"""Description of a scan before a bake: its size, its relief, and the periods that diffract visibly."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np

from ..base.failure import GratingError
from .first_order import COARSEST_PERIOD_M, FINEST_PERIOD_M
from .height_map import HeightMap
from .least_squares_plane import Plane, plane_of
from .periods import Wave, Waves, length_in_words, middle_of, waves_of
from .quality import Quality, judge

_ROWS_AT_ONCE = 256


@dataclass(frozen=True)
class Description:
    """The facts of a height map; see `describe`.

    rows, cols         the size in pixels
    pixel_size_m       (dy, dx) in metres
    height_range_m     highest minus lowest measured height in metres, after plane levelling
    height_rms_m       standard deviation of the same heights in metres
    source_range_m     highest minus lowest height in metres as measured, including the tilt
    periods_m          at most five periods in metres that diffract visibly, brightest first
    period_angles_deg  direction of each grating vector in degrees: from T, counterclockwise towards B, in (-90, 90]
    waves              all waves: gratings, waviness, fine wave and line noise
    quality            the findings that limit the scan
    channels           labels of all channels of the source"""

    rows: int
    cols: int
    pixel_size_m: tuple[float, float]
    height_range_m: float
    height_rms_m: float
    source_range_m: float
    waves: Waves
    quality: Quality
    channels: tuple[str, ...]

    @property
    def periods_m(self) -> tuple[float, ...]:
        return tuple(wave.period_m for wave in self.waves.gratings)

    @property
    def period_angles_deg(self) -> tuple[float, ...]:
        return tuple(wave.angle_deg for wave in self.waves.gratings)

    def as_dict(self) -> dict[str, object]:
        """Return the facts for JSON: tuples become lists, missing waves null."""
        waves = asdict(self.waves)
        return {
            "rows": self.rows,
            "cols": self.cols,
            "pixel_size_m": list(self.pixel_size_m),
            "height_range_m": self.height_range_m,
            "height_rms_m": self.height_rms_m,
            "source_range_m": self.source_range_m,
            "periods_m": list(self.periods_m),
            "period_angles_deg": list(self.period_angles_deg),
            "gratings": list(waves["gratings"]),
            "waviness": waves["waviness"],
            "fine": waves["fine"],
            "line_noise": waves["noise"],
            "quality": self.quality.as_dict(),
            "channels": list(self.channels),
        }

    def in_words(self) -> list[str]:
        """Describe the relief and its waves, a line each, and why a wave is or is not the grating."""
        gratings, waviness, fine, noise = self.waves.gratings, self.waves.waviness, self.waves.fine, self.waves.noise
        band = f"from {length_in_words(FINEST_PERIOD_M)} to {length_in_words(COARSEST_PERIOD_M)}"
        lines = [f"relief: {self.relief_in_words()}"]
        if gratings:
            lines.append(
                f"grating: {_told(gratings[0])}; it sends out the most light of all waves {band}, which show colours"
            )
        else:
            lines.append(f"grating: none; no wave {band}, which would show colours, stands out")
        if noise is not None:
            reason = (
                "the scan in the other direction lacks it; compare its channel, or turn the sample"
                if self.waves.one_way
                else "rows that shift at random show such a wave too; if the surface has lines along the rows, turn it"
            )
            lines.append(
                f"line noise: {_told(noise)}; not taken for a grating, as {reason} by 90 deg and scan it again"
            )
        if waviness is not None and not (gratings and waviness.amplitude_m <= gratings[0].amplitude_m):
            lines.append(
                f"waviness: {_told(waviness)}; not the grating though it is higher, for its colours leave closer "
                "together than the sun is wide"
            )
        if fine is not None and not gratings:
            lines.append(f"finer than light: {_told(fine)}; no visible light leaves by its first order")
        return lines

    def relief_in_words(self) -> str:
        """Format the relief's height: "375 nm", or, if levelling changed it, "408 nm levelled (375 nm as scanned)"."""
        level, source = (
            f"{nm:.0f} nm" if nm >= 10 else f"{nm:.2g} nm"
            for nm in (self.height_range_m * 1e9, self.source_range_m * 1e9)
        )
        return level if level == source else f"{level} levelled ({source} as scanned)"


def describe(height_map: HeightMap, other_way: Callable[[], HeightMap | None] | None = None) -> Description:
    """Measure a height map: its relief before and after plane levelling, its waves, and its quality.

    `other_way` reads the opposite scan direction (trace or retrace), levelled by the same steps, or returns None
    (`read_other_way` of readers/reader_registry.py). It is called only if a wave may be a grating. If it raises
    GratingError, the scan is described alone."""
    plane = plane_of(height_map)

    def other() -> HeightMap | None:
        try:
            found = other_way() if other_way else None
        except GratingError:
            return None
        return found and _middle(found, plane_of(found))

    waves = waves_of(_middle(height_map, plane), height_map.size_m, other=other)
    low, high, rms = _levelled(height_map, plane)
    return Description(
        rows=height_map.rows,
        cols=height_map.cols,
        pixel_size_m=height_map.pixel_size_m,
        height_range_m=high - low,
        height_rms_m=rms,
        source_range_m=float(np.nanmax(height_map.height_m) - np.nanmin(height_map.height_m)),
        waves=waves,
        quality=judge(height_map, plane, waves, reach_m=(low, high)),
        channels=height_map.channels,
    )


def _middle(height_map: HeightMap, plane: Plane) -> HeightMap:
    """Return the middle of a scan, levelled by the plane through the whole scan."""
    return replace(height_map, height_m=plane.level_part(height_map, middle_of(height_map)))


def _levelled(height_map: HeightMap, plane: Plane) -> tuple[float, float, float]:
    """Return lowest, highest and standard deviation of the levelled heights, whose mean is 0.

    It levels a few rows at a time, since all levelled heights would take as much memory as the scan."""
    lows, highs, total, count = [], [], 0.0, 0
    for start in range(0, height_map.rows, _ROWS_AT_ONCE):
        level = plane.level_part(height_map, (slice(start, start + _ROWS_AT_ONCE), slice(None)))
        level = level[np.isfinite(level)]
        count += level.size
        if level.size:
            lows.append(level.min())
            highs.append(level.max())
            total += float(level @ level)
    return float(min(lows)), float(max(highs)), math.sqrt(total / count)


def _told(wave: Wave) -> str:
    return f"{wave.in_words()}, {wave.repeats:.3g} repeats in the scan"
