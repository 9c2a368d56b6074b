# SPDX-License-Identifier: GPL-3.0-or-later
"""The plan of a scene's pictures, which a worker reads in a Blender without the extension.

A plan is JSON beside the .blend file that it is of:

    {"format": 1, "scene": "cd.blend", "recipe": SHA-256, "made_by": FACTS, "pictures": [PICTURE, ...]}

A PICTURE has the fields of Picture and under `id` the SHA-256 of everything that it depends on: a finished picture
with this id need not be rendered again. This file and what it imports need no package, so that a farm's job can carry
them."""

import hashlib
import json
import re
import unicodedata
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from ..base.failure import GratingError
from ..base.files import short_stem, write_whole
from .tables import Limits, Table

PLAN_FORMAT = 1
# The folders of a job's output.
FOLDERS = SCENES, PICTURES, LOGS, NEEDS = "scenes", "pictures", "logs", "needs"
# A film of an hour at 24 frames a second has 86,400 pictures.
PICTURES_MAX = 100_000
# More lamps than a job needs.
LAMPS_MAX = 100
ENGINES = ("cycles", "eevee")
# Blender's limits of frames and seeds, and limits of what a picture may be.
FRAME, SEED = Limits(-1_048_574, 1_048_574), Limits(0, 2**31 - 1)
SAMPLES, SIDE = Limits(1, 1 << 24), Limits(4, 65536)
ZOOM, FACTOR = Limits(1e-3, 1e3), Limits(0.0, 1e6)
AZIMUTH, ELEVATION = Limits(-360.0, 360.0), Limits(-90.0, 90.0)
_RANGE = re.compile(r"(-?\d{1,7})(?:-(-?\d{1,7})(?::(\d{1,7}))?)?", re.ASCII)
_REMEDY = "run the job's earlier steps again"


def _read(reader: Callable[..., Any], *limits: Any) -> Any:
    """A field of a dataclass, which `reader`, given a table, the field's name and the limits, reads from a plan."""
    return field(metadata={"read": lambda table, name: reader(table, name, *limits)})


def _plain(table: Table, key: str, ending: str = "") -> str:
    """A file's name that plain_name gives, and its ending. Raises GratingError for another text."""
    name = table.text(key) or ""
    if not name.endswith(ending) or plain_name(name.removesuffix(ending)) != name.removesuffix(ending):
        raise table.fault(key, f"cannot be {name!r:.40}", "")
    return name


@dataclass(frozen=True)
class LampState:
    """The direction and strength of a lamp in a picture. None: as in the scene."""

    lamp: str = _read(lambda table, name: table.text(name) or "")
    azimuth_deg: float | None = _read(Table.number, AZIMUTH)
    elevation_deg: float | None = _read(Table.number, ELEVATION)
    strength: float | None = _read(Table.number, FACTOR)
    around: str | None = _read(Table.text)


@dataclass(frozen=True)
class Picture:
    """A picture of a job: the name of its files without ending, and what is set before it is rendered. None keeps the
    scene's own setting."""

    name: str = _read(_plain)
    camera: str | None = _read(Table.text)
    zoom: float | None = _read(Table.number, ZOOM)
    lamps: tuple[LampState, ...] = _read(lambda table, name: tuple(map(_lamp, table.tables(name, LAMPS_MAX))))
    engine: str | None = _read(Table.text, ENGINES)
    seed: int | None = _read(Table.integer, SEED)
    frame: int | None = _read(Table.integer, FRAME)
    samples: int | None = _read(Table.integer, SAMPLES)
    denoise: bool | None = _read(Table.flag)
    width: int | None = _read(Table.integer, SIDE)
    height: int | None = _read(Table.integer, SIDE)


# The fields that all pictures of a job share.
QUALITY = ("samples", "denoise", "width", "height")


def values_in(table: Table, kind: type[LampState] | type[Picture], names: Collection[str] = ()) -> dict[str, Any]:
    """The values of the named fields of LampState or Picture, or of all, in a table. Raises GratingError for values
    that a field cannot have."""
    return {one.name: one.metadata["read"](table, one.name) for one in fields(kind) if not names or one.name in names}


def parse_frames(text: str) -> tuple[int, ...]:
    """The frames of a text such as "1-24:2, 30", in its order, each once. Raises ValueError, with the faulty part, for
    any other text, and at the part with which there are more than PICTURES_MAX."""
    frames: dict[int, None] = {}
    named = 0
    for part in text.split(","):
        match = _RANGE.fullmatch(part.strip())
        if match is None:
            raise ValueError(part.strip())
        first = int(match[1])
        last, step = int(match[2] or first), int(match[3] or 1)
        if not FRAME.low <= first <= last <= FRAME.high or step == 0:
            raise ValueError(part.strip())
        named += len(range(first, last + 1, step))
        if named > PICTURES_MAX:
            raise ValueError(part.strip())
        frames.update(dict.fromkeys(range(first, last + 1, step)))
    return tuple(frames)


def plain_name(text: str) -> str:
    """A text as a file name without ending, for every system and as a word of a command: letters and digits of every
    script, dots and dashes. Runs of other characters become one underscore, and a long name is shortened."""
    kept = (c if c in ".-" or unicodedata.category(c)[0] in "LMN" else " " for c in unicodedata.normalize("NFC", text))
    short = short_stem("_".join("".join(kept).split()).strip("._-") or "_")
    return re.sub("_+", "_", short)


def hash_of(record: Any) -> str:
    """The SHA-256, in hexadecimal, of a record as JSON."""
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def plan_of(scene: str, recipe: str, pictures: Sequence[Picture], *, made_by: Mapping[str, Any]) -> dict[str, Any]:
    """The plan of a scene's pictures. `scene` is the name of its .blend, which lies beside the plan, `recipe` a hash of
    everything that the scene depends on, `made_by` facts for the pictures' records."""
    records = [json.loads(json.dumps(asdict(picture))) for picture in pictures]
    identified = [{**record, "id": hash_of([recipe, record])} for record in records]
    return {"format": PLAN_FORMAT, "scene": scene, "recipe": recipe, "made_by": dict(made_by), "pictures": identified}


def write_record(path: Path, record: Mapping[str, Any]) -> None:
    """Write a plan or another record as JSON, whole. Raises GratingError if it cannot be written."""
    text = json.dumps(record, indent=1) + "\n"
    write_whole(path, lambda partial: partial.write_text(text, encoding="utf-8"))


def read_plan(path: Path) -> dict[str, Any]:
    """A plan that is as plan_of makes it, whose names stay within the output. It may be larger than what strict_json
    reads. Raises GratingError for any other file."""
    try:
        plan = json.loads(path.read_text(encoding="utf-8"))
        with Table(path, plan) as whole:
            if whole.take("format") != PLAN_FORMAT:
                raise whole.fault("format", "another version of the extension made it", "")
            scene, recipe, made_by = _plain(whole, "scene", ".blend"), whole.text("recipe"), whole.take("made_by")
            pictures = [_picture(each) for each in whole.tables("pictures", PICTURES_MAX)]
        if not isinstance(made_by, dict) or plan != plan_of(scene, str(recipe), pictures, made_by=made_by):
            raise ValueError("it was changed")
    except (OSError, ValueError, RecursionError) as error:
        raise GratingError(path, f"not a usable plan ({error})", _REMEDY) from error
    except GratingError as error:
        raise GratingError(path, f"not a usable plan ({error.fault})", _REMEDY) from error
    return plan


def _picture(table: Table) -> Picture:
    with table:
        table.take("id")
        return Picture(**values_in(table, Picture))


def _lamp(table: Table) -> LampState:
    with table:
        state = LampState(**values_in(table, LampState))
        if (state.azimuth_deg is None) != (state.elevation_deg is None):
            raise table.fault("azimuth_deg", "one angle alone gives no direction", "")
        return state


def recipe_of_plan(path: Path) -> str | None:
    """The recipe of a plan and of the scene beside it; None if either is missing or damaged."""
    try:
        plan = read_plan(path)
    except GratingError:
        return None
    return str(plan["recipe"]) if (path.parent / plan["scene"]).is_file() else None
