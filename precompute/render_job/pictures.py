# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of a job with their names, the contact sheet that shows them all, and the job's log."""

import itertools
import json
import math
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import Any

from ..base.failure import GratingError
from ..base.files import told_of, write_whole
from ..base.machine import bundled
from .job_file import Job, Sweep
from .plan import PICTURES_MAX, LampState, Picture, plain_name

SHEET = "contact_sheet.png"
# The name of the pictures of a job without gratings.
_SCENE_ALONE = "scene"


def scene_names(job: Job) -> list[str]:
    """The names of a job's scenes: one for each surface, or one without surfaces."""
    return [surface.name for surface in job.surfaces] or [_SCENE_ALONE]


def pictures_of(job: Job, scene_name: str) -> list[Picture]:
    """The pictures of one of a job's scenes, all combinations, the frames last. Raises GratingError if the whole job
    has more than PICTURES_MAX, or if two pictures would have the same name."""
    if (count := _count(job)) > PICTURES_MAX:
        raise GratingError(job.path, f"{count} pictures", f"split the job: at most {PICTURES_MAX}")
    lamps = [_states(sweep) for sweep in job.sweeps]
    axes: list[Sequence[Any]] = [job.views.cameras or (None,), job.views.zooms or (None,), *lamps, _renderings(job)]
    axes.append(job.views.frames or (None,))
    found = [
        Picture(
            _name(job, scene_name, choice), choice[0], choice[1], tuple(choice[2:-2]), choice[-2][0], choice[-2][1],
            choice[-1], **job.views.quality,
        )
        for choice in itertools.product(*axes)
    ]  # fmt: skip
    ((double, times),) = Counter(picture.name.lower() for picture in found).most_common(1)
    if times > 1:
        raise GratingError(job.path, f"two pictures would be {double}.png", "rename the cameras or lamps that differ")
    return found


def _count(job: Job) -> int:
    """The number of a job's pictures, counted before any of them is made."""
    swept = [values for sweep in job.sweeps for values in (sweep.azimuth_deg, sweep.elevation_deg, sweep.strength)]
    axes = [scene_names(job), job.views.cameras, job.views.zooms, job.views.frames, *swept, _renderings(job)]
    return math.prod(max(1, len(axis)) for axis in axes)


def _renderings(job: Job) -> list[tuple[str | None, int | None]]:
    """Engines with their seeds. EEVEE has no seed, so it renders with the first only."""
    seeds: Sequence[int | None] = job.views.seeds or (None,)
    return [(e, s) for e in job.views.engines or (None,) for s in (seeds[:1] if e == "eevee" else seeds)]


def _states(sweep: Sweep) -> list[LampState]:
    axes = (sweep.azimuth_deg or (None,), sweep.elevation_deg or (None,), sweep.strength or (None,))
    return [LampState(sweep.lamp, *choice, sweep.around) for choice in itertools.product(*axes)]


def _name(job: Job, scene_name: str, choice: Sequence[Any]) -> str:
    """A picture's name: that of its scene, and what changes within the scene, shortened if it is too long."""
    camera, zoom, *lamps, (engine, seed), frame = choice
    parts = [scene_name]
    if len(job.views.cameras) > 1:
        parts.append(plain_name(camera))
    if len(job.views.zooms) > 1:
        parts.append(f"x{zoom:g}")
    for sweep, state in zip(job.sweeps, lamps, strict=True):
        changed = [
            f"{letter}{getattr(state, field):g}"
            for letter, field in (("a", "azimuth_deg"), ("e", "elevation_deg"), ("s", "strength"))
            if len(getattr(sweep, field)) > 1
        ]
        if changed:
            parts.append("-".join([plain_name(sweep.lamp), *changed]))
    if len(job.views.engines) > 1:
        parts.append(engine)
    if len(job.views.seeds) > 1:
        parts.append(f"seed{seed}")
    if frame is not None:
        parts.append(f"{frame:04d}")
    return plain_name("_".join(parts))


# Width of a tile, gap between tiles, and height of a label, in pixels; the widest sheet.
_TILE, _GAP, _LABEL, _WIDEST = 192, 6, 14, 8192
_PAPER, _INK, _MISSING = (24, 24, 24), (222, 222, 222), (70, 30, 30)
# At most so many pictures are shown, evenly chosen: a sheet of ten thousand cannot be looked at.
SHOWN_MAX = 600


def write_sheet(path: Path, pictures: Sequence[Path]) -> int:
    """Write a PNG with the PNG pictures in their order, in nearly a square. Missing pictures have a dark red tile.
    Returns how many are missing. Raises GratingError if the sheet cannot be written."""
    image, drawing, fonts = (bundled(f"PIL.{module}") for module in ("Image", "ImageDraw", "ImageFont"))
    step = max(1, math.ceil(len(pictures) / SHOWN_MAX))
    shown = pictures[::step]
    tiles = [_tile(picture, image) for picture in shown]
    height = max((tile.height for tile in tiles if tile is not None), default=_TILE)
    columns = max(1, min(math.ceil(math.sqrt(len(tiles) * (height + _LABEL) / _TILE)), _WIDEST // (_TILE + _GAP)))
    rows = math.ceil(len(tiles) / columns)
    size = columns * (_TILE + _GAP) + _GAP, rows * (height + _LABEL + _GAP) + _GAP
    sheet = image.new("RGB", size, _PAPER)
    draw, font = drawing.Draw(sheet), fonts.load_default(size=10)
    for index, (picture, tile) in enumerate(zip(shown, tiles, strict=True)):
        row, column = divmod(index, columns)
        left, top = _GAP + column * (_TILE + _GAP), _GAP + row * (height + _LABEL + _GAP)
        if tile is None:
            draw.rectangle((left, top, left + _TILE - 1, top + height - 1), _MISSING)
        else:
            sheet.paste(tile, (left, top))
        draw.text((left, top + height + 1), _fitting(picture.stem, font), _INK, font)
    write_whole(path, lambda partial: sheet.save(partial))
    return sum(tile is None for tile in tiles)


def _fitting(text: str, font: Any) -> str:
    """A text cut at its beginning, where names of pictures are alike, to the width of a tile."""
    if font.getlength(text) <= _TILE:
        return text
    while text and font.getlength(f"...{text}") > _TILE:
        text = text[1:]
    return f"...{text}"


def _tile(path: Path, image: ModuleType) -> Any | None:
    """A picture at the width of a tile, or None if it cannot be read."""
    try:
        with image.open(path) as picture:
            height = max(1, min(4 * _TILE, round(picture.height * _TILE / picture.width)))
            return picture.convert("RGB").resize((_TILE, height))
    except (OSError, ValueError, SyntaxError):
        return None


class Log:
    """Appends events to a file, each as a line that is there at once: `time` in UTC, `event`, and its facts. Raises
    GratingError if it cannot be written."""

    def __init__(self, path: Path) -> None:
        self._path = path
        with told_of(path):
            path.parent.mkdir(parents=True, exist_ok=True)

    def __call__(self, event: str, **facts: Any) -> None:
        record = {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "event": event, **facts}
        with told_of(self._path), self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(record) + "\n")
