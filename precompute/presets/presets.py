# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets: ready-made surfaces, each a JSON file beside this one.

A new file is a new preset: the command line and Blender's menu list it. A file elsewhere is a preset by its path. The
file has these keys:

    title           the name that people read
    request         a request for a bake, as in the header of a bake; its scans are samples or gratings by parameters
    base_color      linear red, green and blue of the material under the relief, from 0 to 1
    base_roughness  roughness of that material, from 0 to 1
    direction       what the scan's x axis follows: one of DIRECTIONS; it may be missing
    inputs          numbers for the inputs of the Diffraction node, by name; it may be missing
    shape           what Show Me puts it on, one of SHAPES; it may be missing
    hologram        a pattern and numbers for its inputs; it may be missing
    sources         lines that say where each number comes from, or that it was chosen by eye

A hologram is a pattern of directions and periods that the material begins with. The patterns are node groups of the
add-on (addon/materials/holograms/patterns.py); a pattern from a picture needs a file, so no preset has it.

The package ships draft bakes of the presets, so that a preset can be shown without a bake. A draft's folder holds the
bake's files and draft.json: the version and the request of the bake, and its facts as `bake --json` prints them,
without time and memory. So two drafts made on the same kind of processor are the same bytes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path
from typing import Any

from ..bake.cache import BAKE_VERSION
from ..bake.request import BakeRequest, Scan, request_from
from ..base.failure import GratingError
from ..base.files import write_whole
from ..base.strict import number_in, read_json
from ..optics.brdf import IOR_MAX
from ..surface.generated.parameters import canonical, parse_grating
from ..surface.height_map import GRATING_PREFIX, SAMPLE_PREFIX
from ..surface.samples.catalogue import SAMPLES

_RANDOM = {"Period Spread": (1.0, 4.0), "Seed": (0.0, 1000.0)}
_TURN = {"Turn": (0.0, pi / 2)}
_CENTRE = {"Center X": (-1e3, 1e3), "Center Y": (-1e3, 1e3)}
# The patterns, and their inputs with their limits. Angles are in radians.
PATTERNS: dict[str, dict[str, tuple[float, float]]] = {
    "dot_matrix": {"Cells": (1.0, 1e5)} | _TURN | _RANDOM,
    "sunburst": {"Twist": (-pi / 2, pi / 2), "Sectors": (0.0, 1000.0)} | _CENTRE | _RANDOM,
    "crystal": {"Shards": (0.1, 1e5), "Randomness": (0.0, 1.0)} | _TURN | _RANDOM,
}
_HOLOGRAM_KEYS = ("pattern", "inputs")


@dataclass(frozen=True)
class PresetHologram:
    """A pattern, one of PATTERNS, and values for its inputs. The other inputs keep their defaults."""

    pattern: str
    inputs: Mapping[str, float]

    def as_dict(self) -> dict[str, Any]:
        """The hologram as in a preset's file."""
        return {"pattern": self.pattern, "inputs": dict(self.inputs)}


def hologram_from(record: object, source: str) -> PresetHologram:
    """The hologram in a JSON record. Raises GratingError, with `source`, for a faulty one."""
    if not isinstance(record, Mapping) or "pattern" not in record:
        raise GratingError(source, f"hologram: cannot be {record!r:.30}", "give an object with pattern")
    for key in record:
        if key not in _HOLOGRAM_KEYS:
            raise GratingError(source, f"hologram: {key:.40}: no such key", f"there are {', '.join(_HOLOGRAM_KEYS)}")
    pattern, inputs = record["pattern"], record.get("inputs", {})
    if not isinstance(pattern, str) or pattern not in PATTERNS:
        raise GratingError(
            source, f"hologram: pattern: cannot be {pattern!r:.30}", f"give one of {', '.join(PATTERNS)}"
        )
    return PresetHologram(pattern, numbers_in(inputs, PATTERNS[pattern], source, part="hologram: inputs"))


def numbers_in(record: object, known: Mapping[str, tuple[float, float]], source: str, *, part: str) -> dict[str, float]:
    """The numbers in a JSON record, whose names and limits are `known`. Raises GratingError, with `source`, the part of
    the file and the name, for an unknown name or a value out of its limits."""
    if not isinstance(record, Mapping):
        raise GratingError(source, f"{part}: cannot be {record!r:.30}", "give an object of names and numbers")
    for name in record:
        if name not in known:
            raise GratingError(source, f"{part}: {name:.40}: no such input", f"there are {', '.join(known)}")
    return {name: number_in(source, f"{part}: {name}", value, limits=known[name]) for name, value in record.items()}


FOLDER = Path(__file__).parent
# The choices of `direction`: the direction that the mesh stores, or outwards from the object's Z axis as on a disc.
DIRECTIONS = ("stored", "radial")
# The choices of `shape`. The first is the default.
SNAKES = ("xenopeltis", "elaphe")
SHAPES = ("ball", "sheet", "disc", "record", *SNAKES)
# The inputs of the Diffraction node that a preset may set, with their limits.
INPUTS = {
    "Base Blend": (0.0, 1.0),
    "Strength": (0.0, 1000.0),
    "Roughness": (0.0, 1.0),
    "IOR": (1.0, IOR_MAX),
    "Rotation": (-1e3, 1e3),
    "Period Scale": (0.1, 10.0),
    "Height Scale": (0.0, 1.0),
}
_REQUIRED = ("title", "request", "base_color", "base_roughness", "sources")
_KEYS = (*_REQUIRED, "direction", "shape", "inputs", "hologram")
# The longest title in characters; a menu shows it. A source is a line of a table.
_TITLE_MAX, _SOURCE_MAX = 60, 400
_ENDING = ".json"
_WORKING = "compare it with a preset that works"


@dataclass(frozen=True)
class Preset:
    """A ready-made surface.

    name            the file's name without its ending, for the command line
    title           the name that people read
    request         the request for its bake
    base_color      linear red, green and blue of the material under the relief
    base_roughness  roughness of that material
    direction       what the scan's x axis follows, one of DIRECTIONS
    shape           what Show Me puts it on, one of SHAPES
    inputs          values for inputs of the Diffraction node
    hologram        the pattern that its material begins with, or None
    sources         where each number comes from, a line each"""

    name: str
    title: str
    request: BakeRequest
    base_color: tuple[float, float, float]
    base_roughness: float
    direction: str
    shape: str
    inputs: Mapping[str, float]
    hologram: PresetHologram | None
    sources: tuple[str, ...]


def preset_names(folder: Path = FOLDER) -> tuple[str, ...]:
    """The names of all presets, in alphabetical order."""
    return tuple(sorted(path.stem for path in folder.glob(f"*{_ENDING}")))


def read_preset(name: str, folder: Path = FOLDER) -> Preset:
    """Read a preset by its name, or by the path of its file, which ends in .json. Raises GratingError for an unknown
    name or a faulty file."""
    known = preset_names(folder)
    if name.lower().endswith(_ENDING):
        path = Path(name)
    elif name in known:
        path = folder / f"{name}{_ENDING}"
    else:
        remedy = f"choose one of {', '.join(known)}, or give a {_ENDING} file"
        raise GratingError(f"preset {name:.40}", "there is no such preset", remedy)
    record, file = read_json(path, _WORKING), path.name
    if not isinstance(record, dict):
        raise GratingError(file, "holds no preset", f"give an object with {', '.join(_REQUIRED)}")
    for key in record:
        if key not in _KEYS:
            raise GratingError(file, f"{key:.40}: no such key of a preset", f"there are {', '.join(_KEYS)}")
    for key in _REQUIRED:
        if key not in record:
            raise GratingError(file, f"{key}: is missing", f"add `{key}`; {_WORKING}")
    return Preset(
        path.stem,
        title=_title(file, record["title"]),
        request=_request(file, record["request"]),
        base_color=_colour(file, record["base_color"]),
        base_roughness=number_in(file, "base_roughness", record["base_roughness"], limits=(0.0, 1.0)),
        direction=_one_of(file, "direction", record.get("direction", DIRECTIONS[0]), choices=DIRECTIONS),
        shape=_one_of(file, "shape", record.get("shape", SHAPES[0]), choices=SHAPES),
        inputs=inputs_of(record.get("inputs", {}), file),
        hologram=hologram_from(record["hologram"], file) if "hologram" in record else None,
        sources=_sources(file, record["sources"]),
    )


def inputs_of(record: object, source: str) -> dict[str, float]:
    """The values for inputs of the Diffraction node in a JSON record. Raises GratingError, with `source` and the input,
    for an unknown input or a value out of its limits."""
    return numbers_in(record, INPUTS, source, part="inputs")


def _request(file: str, record: Any) -> BakeRequest:
    """The request of a preset, with the canonical texts of its gratings."""
    request = request_from(record, f"{file}: request")
    if not request.scans:
        raise GratingError(file, "request: names no scan", "add a sample or a grating under `scans`")
    return replace(request, scans=tuple(_scan(file, scan) for scan in request.scans))


def _scan(file: str, scan: Scan) -> Scan:
    name = scan.source.removeprefix(SAMPLE_PREFIX)
    if scan.source.startswith(GRATING_PREFIX):
        try:
            parse_grating(scan.source)
        except GratingError as error:
            raise error.within(f"{file}: request") from error
    elif not scan.source.startswith(SAMPLE_PREFIX):
        remedy = f"give {SAMPLE_PREFIX}NAME or {GRATING_PREFIX}KIND, which need no file"
        raise GratingError(file, f"request: {name:.40} is a file", remedy)
    elif name not in SAMPLES:
        raise GratingError(file, f"request: there is no sample {name:.40}", f"choose one of {', '.join(SAMPLES)}")
    return replace(scan, source=canonical(scan.source))


def _title(file: str, value: Any) -> str:
    if not isinstance(value, str) or not value.strip() or len(value) > _TITLE_MAX or not value.isprintable():
        raise GratingError(file, f"title: cannot be {value!r:.30}", f"give a text of 1 to {_TITLE_MAX} characters")
    return value


def _colour(file: str, value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(value) != 3:
        raise GratingError(file, f"base_color: cannot be {value!r:.30}", "give red, green and blue")
    red, green, blue = (number_in(file, "base_color", each, limits=(0.0, 1.0)) for each in value)
    return red, green, blue


def _one_of(file: str, key: str, value: Any, *, choices: tuple[str, ...]) -> str:
    if value not in choices:
        raise GratingError(file, f"{key}: cannot be {value!r:.30}", f"give one of {', '.join(choices)}")
    return str(value)


def _sources(file: str, value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or not value:
        raise GratingError(file, "sources: names none", "say where each number comes from, or that it is by eye")
    for line in value:
        if not isinstance(line, str) or not line.strip() or len(line) > _SOURCE_MAX or not line.isprintable():
            remedy = f"give lines of 1 to {_SOURCE_MAX} characters"
            raise GratingError(file, f"sources: cannot be {line!r:.30}", remedy)
    return tuple(value)


DRAFTS = Path(__file__).parents[2] / "drafts"
# The settings of a draft. Its colours are softer than those of a full bake, and its files are a few megabytes.
DELTA_E, COHERENCE_M = 3.0, 10e-6
_RECORD = "draft.json"
# The number of the record's format.
_FORMAT = 2
# Facts of a run, which differ from one run to the next.
_OF_THE_RUN = ("seconds", "check_seconds", "peak_bytes", "cached")


def draft_request(request: BakeRequest) -> BakeRequest:
    """The request for a draft of the same surface."""
    return replace(request, delta_e=DELTA_E, coherence_length_m=COHERENCE_M)


def shipped_draft(name: str, request: BakeRequest, folder: Path = DRAFTS) -> dict[str, Any] | None:
    """The facts of a preset's shipped draft, with the paths of its files. `request` is the draft's request. Returns
    None if there is no draft, or if it was made by another version or from another request."""
    home = folder / name
    try:
        record = read_json(home / _RECORD, "build the package again")
        facts = dict(record["facts"])
        files = [home / str(file) for file in facts["files"]]
        current = (record["format"], record["version"], record["request"]) == (_FORMAT, *_made_by(request))
    except (GratingError, KeyError, TypeError, ValueError):
        return None
    if not (current and files and all(file.is_file() for file in files)):
        return None
    return facts | {"files": [str(file) for file in files]}


def write_draft(request: BakeRequest, facts: Mapping[str, Any]) -> None:
    """Record a draft's request and the facts of its bake beside its files, in the folder of the preset's name. Raises
    GratingError if the record cannot be written."""
    files = list(map(Path, facts["files"]))
    kept = {name: value for name, value in facts.items() if name not in _OF_THE_RUN}
    version, asked = _made_by(request)
    kept["files"] = [file.name for file in files]
    text = json.dumps({"format": _FORMAT, "version": version, "request": asked, "facts": kept}, indent=1) + "\n"
    write_whole(files[0].with_name(_RECORD), lambda path: path.write_text(text, encoding="utf-8"))


def _made_by(request: BakeRequest) -> tuple[int, Any]:
    """The version of bakes, and a request as it is read from JSON."""
    return BAKE_VERSION, json.loads(json.dumps(request.as_dict()))
