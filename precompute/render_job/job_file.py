# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a render job from its TOML file. EXAMPLE has every key. Every value is checked before any work begins."""

import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..bake.request import HEIGHT_NM, SIZE_UM, BakeRequest, request_from
from ..base.failure import GratingError
from ..base.files import can_be_a_path, read_limited
from ..presets.presets import read_preset
from ..reflectance.matter import parse as parse_matter
from ..surface.height_map import is_synthetic
from . import plan
from .tables import Limits, Table

EXAMPLE = """\
# Paths are relative to this file. The pictures are all combinations. A key that is left out keeps the scene's setting.
scene = "snake.blend"           # default: the open file; without one, Show Me's scene of each preset
output = "renders"              # folder of the results; default: this file's name without its ending
needs = true                    # bake only the directions that the pictures show; default false

[pictures]
frames = "1-24:2, 30"           # every second frame from 1 to 24, and 30; or a list
cameras = ["Camera"]
zooms = [1, 2.5]                # factors on the focal length
engines = ["cycles", "eevee"]
seeds = [0, 1]                  # of Cycles; EEVEE renders the first only
samples = 64
denoise = false                 # whether Cycles denoises
width = 320                     # pixels
height = 240

[[grating]]                     # once for each; without any, the scene's own materials stay
preset = "cd"                   # or its .json file
matters = ["gold", "silver"]    # the pictures are rendered once with each
objects = ["Disc"]              # the meshes that wear it; default: the selected ones
over = true                     # on top of the meshes' own materials; default false
lights = "rest"                 # or lamps, or all
inputs = {Roughness = 0.2}      # inputs of its material, angles in degrees

[[grating]]
name = "skin"                   # begins its pictures' names; default: the name of the preset or scan
scans = ["a.nid", "b.png"]      # of one skin; also sample:NAME and grating:KIND?PARAMETERS
size_um = 65                    # as of `bake --size-um`; also height_nm and channel
delta_e = 1                     # as of `bake`; also coherence_um, illuminant, levelling (a list of steps), model,
                                # spread_deg and patch_um
objects = ["Snake"]

[[light]]                       # once for each lamp that turns, goes round an object or changes its strength
lamp = "Sun"
azimuth_deg = [0, 90]           # where the light comes from: counter-clockwise from +X,
elevation_deg = [30, 60]        # and above the horizon
strength = [0.5, 1]             # factors on its strength
around = "Snake"                # the object that it goes round; a sun needs none
"""
LIGHTS = ("rest", "lamps", "all")
_LARGEST_BYTES = 1 << 20
# More than a job needs; a template of Open Job Description lists at most 1024 values.
_GRATINGS_MOST = 1024
_REMEDY = "compare it with the example of `job --help`"
_WIDTH, _HEIGHT = Limits(*SIZE_UM), Limits(*HEIGHT_NM)
# Keys of a request that a grating may set.
_REQUEST = ("delta_e", "coherence_um", "illuminant", "levelling", "model", "spread_deg", "patch_um")


@dataclass(frozen=True)
class Surface:
    """A grating of a job, of one matter.

    name     names its scene and its pictures; letters, digits, dots, dashes and underscores
    preset   the preset that it is, or the absolute path of its file, or None
    request  the request for its bake
    objects  the meshes that wear it
    over     whether it is added to the meshes' own materials
    lights   one of LIGHTS, or None for the grating's setting
    inputs   values of the material's inputs, angles in degrees"""

    name: str
    preset: str | None
    request: BakeRequest
    objects: tuple[str, ...] = ()
    over: bool = False
    lights: str | None = None
    inputs: tuple[tuple[str, float], ...] = ()

    @property
    def files(self) -> list[Path]:
        """The files that it is made from, absolute."""
        preset = [self.preset] if self.preset is not None and _is_file(self.preset) else []
        scans = [scan.source for scan in self.request.scans if not is_synthetic(scan.source)]
        return [Path(file) for file in (*preset, *scans)]


@dataclass(frozen=True)
class Sweep:
    """The directions and strengths of a lamp. Angles are in degrees; empty: as in the scene."""

    lamp: str
    azimuth_deg: tuple[float, ...] = ()
    elevation_deg: tuple[float, ...] = ()
    strength: tuple[float, ...] = ()
    around: str | None = None


@dataclass(frozen=True)
class Views:
    """How the pictures of a job are taken: its table `pictures`."""

    frames: tuple[int, ...] = ()
    cameras: tuple[str, ...] = ()
    zooms: tuple[float, ...] = ()
    engines: tuple[str, ...] = ()
    seeds: tuple[int, ...] = ()
    quality: Mapping[str, Any] = field(default_factory=dict)  # of every picture (plan.py)


@dataclass(frozen=True)
class Job:
    """A render job. An empty tuple or None keeps the scene's own setting. `scene` and `output` are absolute."""

    path: Path
    scene: Path | None
    output: Path
    needs: bool
    surfaces: tuple[Surface, ...]
    sweeps: tuple[Sweep, ...]
    views: Views

    @property
    def inputs(self) -> list[Path]:
        """The files that the job reads, absolute."""
        scene = [self.scene] if self.scene else []
        return sorted({self.path.resolve(), *scene, *(file for surface in self.surfaces for file in surface.files)})


def read_job(path: Path, *, opened: Path | None = None, output: Path | None = None) -> Job:
    """Read a job. Paths in it are relative to its folder. `opened` is the scene of a job that names none; `output`
    replaces the job's folder. Raises GratingError with the key of the first faulty value, or if the output would hold
    a file that the job reads."""
    content = read_limited(path, _LARGEST_BYTES, "give the .toml file of a job")
    if len(content) > _LARGEST_BYTES:
        raise GratingError(path, f"larger than {_LARGEST_BYTES >> 20} MiB", "split the job")
    try:
        record = tomllib.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:  # also wrong UTF-8
        raise GratingError(path, f"not TOML that can be used ({error})", _REMEDY) from error
    folder = path.resolve().parent
    with Table(path, record) as whole:
        named, written = whole.text("scene"), whole.text("output") or path.stem
        for key, value in (("scene", named), ("output", written)):
            if value is not None and not can_be_a_path(value):
                raise whole.fault(key, "not a file name", "give a path")
        scene = opened if named is None else folder / named
        needs = bool(whole.flag("needs"))
        views = _views(whole.table("pictures"))
        surfaces = tuple(one for each in whole.tables("grating", _GRATINGS_MOST) for one in _surfaces(each, folder))
        sweeps = tuple(_sweep(each) for each in whole.tables("light", plan.LAMPS_MAX))
    _check_names(path, "grating", [each.name.lower() for each in surfaces])
    _check_names(path, "light", [each.lamp for each in sweeps])
    if scene is None and any(each.preset is None for each in surfaces):
        raise GratingError(path, "grating: scans need a scene to be put on", 'add scene = "FILE.blend" to the job')
    if needs and not surfaces:
        raise GratingError(path, "needs: there is no grating to bake", "add one as [[grating]], or leave `needs` out")
    written_to = folder / written if output is None else output.resolve()
    job = Job(path, scene, written_to, needs, surfaces, sweeps, views)
    places = [place.resolve() for place in (written_to, *(written_to / name for name in plan.FOLDERS))]
    for file in job.inputs:
        if any(file.resolve().is_relative_to(place) for place in places):
            raise GratingError(
                path, f"output: {written_to} holds {file}, which the job reads", "give a folder of its own"
            )
    return job


def _views(table: Table) -> Views:
    with table:
        return Views(
            _frames(table),
            table.texts("cameras"),
            table.numbers("zooms", plan.ZOOM),
            table.texts("engines", plan.ENGINES),
            table.integers("seeds", plan.SEED),
            plan.values_in(table, plan.Picture, plan.QUALITY),
        )


def _frames(pictures: Table) -> tuple[int, ...]:
    """The frames in their order, each once. They are a text such as "1-24:2, 30", or a list of whole numbers."""
    if not isinstance(pictures.take("frames"), str):
        return pictures.integers("frames", plan.FRAME)
    try:
        return plan.parse_frames(pictures.text("frames") or "")
    except ValueError as error:
        fault = f"cannot be {str(error)!r:.30}"
        raise pictures.fault("frames", fault, 'give ranges such as "1-24:2, 30"') from error


def _surfaces(table: Table, folder: Path) -> list[Surface]:
    """The surfaces of a [[grating]], one for each of its matters."""
    with table:
        preset, scans = table.text("preset"), table.texts("scans")
        if preset is not None and _is_file(preset):
            preset = str(folder / preset)
        if (preset is None) == (not scans):
            raise table.fault("preset", "give either `preset` or `scans`", _REMEDY)
        name = table.text("name") or _name_of(preset or scans[0])
        request = table.within(lambda: _request(table, preset, scans, folder))
        matters = table.texts("matters")
        one = Surface(
            plan.plain_name(name),
            preset,
            request,
            table.texts("objects"),
            bool(table.flag("over")),
            table.text("lights", LIGHTS),
            table.pairs("inputs"),
        )
    made = table.within(lambda: [parse_matter(text) for text in matters])
    if len(made) < 2:
        return [replace(one, request=replace(request, matter=matter)) for matter in made] or [one]
    return [
        replace(one, name=plan.plain_name(f"{name}_{matter}"), request=replace(request, matter=matter))
        for matter in made
    ]


def _is_file(preset: str) -> bool:
    return preset.lower().endswith(".json")


def _name_of(source: str) -> str:
    """The name of a preset, of a file, or of a synthetic surface."""
    return source.partition(":")[2] if is_synthetic(source) else Path(source).stem


def _request(table: Table, preset: str | None, scans: tuple[str, ...], folder: Path) -> BakeRequest:
    """The request for a surface's bake, its scans absolute. Raises GratingError for values that no bake can have."""
    given = {key: value for key in _REQUEST if (value := table.take(key)) is not None}
    if preset is None:
        sizes = {
            "size_um": table.number("size_um", _WIDTH),
            "height_nm": table.number("height_nm", _HEIGHT),
            "channel": table.text("channel"),
        }
        return request_from({"scans": [{"source": one, **sizes} for one in scans], **given}, "its bake").at(folder)
    whole = read_preset(preset).request
    record = whole.as_dict() | given
    return replace(request_from(record, "its bake"), scans=whole.scans)


def _sweep(table: Table) -> Sweep:
    with table:
        sweep = Sweep(
            table.text("lamp") or "",
            table.numbers("azimuth_deg", plan.AZIMUTH),
            table.numbers("elevation_deg", plan.ELEVATION),
            table.numbers("strength", plan.FACTOR),
            table.text("around"),
        )
        if not sweep.lamp:
            raise table.fault("lamp", "is missing", "name a lamp of the scene")
        if bool(sweep.azimuth_deg) != bool(sweep.elevation_deg):
            raise table.fault("azimuth_deg", "one angle alone gives no direction", "give azimuth_deg and elevation_deg")
    return sweep


def _check_names(path: Path, key: str, names: list[str]) -> None:
    """Raise GratingError if two have the same name."""
    if doubles := sorted(name for name, count in Counter(names).items() if count > 1):
        raise GratingError(path, f"{key}: {', '.join(doubles)} appears twice", "give each a name of its own")


def as_record(surface: Surface) -> Mapping[str, Any]:
    """What a surface's scene depends on, without the heights of its scans, for a hash."""
    return {
        "preset": surface.preset, "request": surface.request.as_dict(), "objects": surface.objects,
        "over": surface.over, "lights": surface.lights, "inputs": surface.inputs,
    }  # fmt: skip
