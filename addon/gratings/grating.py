# SPDX-License-Identifier: GPL-3.0-or-later
"""The gratings of a scene: for each the height map, its matter, the settings of its bake, the bake's file, the lights
that it responds to, and how it varies over a skin. Saved .blend files contain the names, so they must not change."""

import json
from dataclasses import asdict, dataclass, replace
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from ...precompute.base.failure import GratingError
from ...precompute.reflectance.films import METALS
from ..blender import stored
from ..blender.guard import absolute, is_there, pure
from .cache_folder import cache_folder
from .direction_source import AXES, KINDS, STORED, DirectionSource, file_has_comb
from .levelling_steps import LevellingStep
from .material_look import MaterialLook
from .own_names import follow_name
from .wording import translated

if TYPE_CHECKING:
    from ...precompute.bake.needs import Needs
    from ...precompute.bake.request import BakeRequest


# The matter that the field Layers describes.
LAYERS = "LAYERS"
# The number of each matter in .blend files. Numbers stay as they are: a new matter takes the next free number, wherever
# it stands in the menu.
_NUMBERS = {
    "DIELECTRIC": 0, "ALUMINIUM": 1, "SILVER": 2, "GOLD": 3, "COPPER": 4, "CHROMIUM": 5, "NICKEL": 6, "TITANIUM": 7,
    LAYERS: 8, "MIRROR": 9,
}  # fmt: skip
_TEXTS = (
    ("DIELECTRIC", "Dielectric", "Skin, horn, plastic, varnish or glass. Its IOR can be changed in the material"),
    *((metal.upper(), metal.capitalize(), f"Polished {metal}") for metal in METALS),
    (LAYERS, "Layers", "Thin films on a substrate, as in a beetle's shell or a coated foil"),
    ("MIRROR", "Perfect Mirror", "Reflects all light"),
)
# Items of the menu: identifier, label, tooltip, icon, number.
MATTERS = tuple((name, label, text, "NONE", _NUMBERS[name]) for name, label, text in _TEXTS)
# The index of no plate, and the greatest index of a plate (precompute/optics/plate.py, which loads only when needed).
PLATE_IORS = 1.0, 3.0
# The illuminant if the field is empty.
DAYLIGHT = "D65"
# Digits of a plate's index. Single precision, in which Blender stores the field, has seven.
_DIGITS = 6


class MatterFields(Protocol):
    """The part of a grating that says what it is made of."""

    name: str
    matter: str
    layers: str
    plate_ior: float


def matter_text(grating: MatterFields) -> str:
    """The matter in the form of `--matter`. Raises GratingError for layers that are not valid."""
    from ...precompute.reflectance.matter import parse

    if not grating.matter:  # a file of another version may hold no item of the menu
        return ""
    try:
        matter = parse(grating.layers if grating.matter == LAYERS else grating.matter)
    except GratingError as error:
        raise error.within(f"{grating.name}: Layers") from error
    # A text of layers may name its own plate.
    with_plate = matter.baked and not matter.has_plate
    return str(replace(matter, plate_ior=float(f"{grating.plate_ior:.{_DIGITS}g}")) if with_plate else matter)


def take_matter(grating: MatterFields, text: str) -> None:
    """Set the fields from a matter in the form of `--matter`."""
    from ...precompute.reflectance.matter import parse

    matter = parse(text)
    grating.plate_ior, bare = matter.plate_ior, str(replace(matter, plate_ior=PLATE_IORS[0]))
    if bare.upper() in (name for name, *_ in MATTERS if name != LAYERS):
        grating.matter = bare.upper()
    else:
        grating.matter, grating.layers = LAYERS, bare


class LitField(Protocol):
    """The part of a grating that has the field."""

    name: str
    illuminant: str


def keep_file(grating: LitField) -> None:
    """Replace the path of a file by its spectrum, so that the .blend file holds it. A path that cannot be read stays,
    and the bake reports it."""
    try:
        held = illuminant_text(grating)
    except GratingError:
        return
    if ":" in held and held != grating.illuminant:
        grating.illuminant = held


def illuminant_text(grating: LitField) -> str:
    """The illuminant's canonical text. Raises GratingError for a text that names none, and for a damaged file."""
    from ...precompute.colour.illuminants import illuminant_of

    try:
        return illuminant_of(absolute(grating.illuminant or DAYLIGHT))
    except GratingError as error:
        raise error.within(f"{grating.name}: Lamp Spectrum") from error


def known_names(typed: str) -> list[str]:
    """The names and examples that contain a typed text: lights of several lamps first, then single lamps."""
    from ...precompute.colour.illuminants import CHANNEL_SETS, names_with

    several = [name for name in (*CHANNEL_SETS, "led+tube") if typed.lower() in name]
    return several + names_with(typed)


class Quality(NamedTuple):
    """A step: its name, its label, its tooltip, the colour error and the coherence length in micrometres (0:
    automatic)."""

    name: str
    label: str
    tooltip: str
    delta_e: float
    coherence_um: float


QUALITIES = (
    # The draft's settings are those of the drafts that the extension ships (precompute/presets/presets.py).
    Quality("DRAFT", "Draft", "Bakes fast, soft colours, little memory: colour error 3 under small lamps", 3.0, 10.0),
    Quality("GOOD", "Good", "For most pictures: colour error 1 under small lamps. The eye hardly sees it", 1.0, 0.0),
    Quality("EXACT", "Exact", "For close-ups: colour error 0.3 under small lamps. Slow, takes more memory", 0.3, 0.0),
)  # fmt: skip


class QualityFields(Protocol):
    """The part of a grating that says how exact its bake is."""

    delta_e: float
    coherence_um: float


def quality_of(grating: QualityFields) -> str:
    """The name of a grating's step; empty if its settings are those of none."""
    # Blender stores the fields in single precision.
    given = tuple(float(f"{value:.6g}") for value in (grating.delta_e, grating.coherence_um))
    return next((each.name for each in QUALITIES if (each.delta_e, each.coherence_um) == given), "")


def take_quality(grating: QualityFields, name: str) -> None:
    """Set a grating's fields to those of a step."""
    quality = next(each for each in QUALITIES if each.name == name)
    grating.delta_e, grating.coherence_um = quality.delta_e, quality.coherence_um


LAMPS_ONLY, REST, ALL = "LAMPS", "REST", "ALL"
# Identifier, label and tooltip, as in Blender's enumerations.
LIGHTS = (
    (REST, "Lamps and World", "Lamps and bright spots of the world light it without noise. The rest of the world and "
     "other objects light it with noise. Without lamps, the world lights it alone"),
    (LAMPS_ONLY, "Lamps Only", "The lamps light it with next to no noise. The world and other objects have no effect. "
     "Without lamps the diffraction is black"),
    (ALL, "All by Samples", "Every light comes by random samples. This is exact but noisy, most of all under small "
     "lamps. For reference pictures"),
)  # fmt: skip
CHOICES = {name for name, _, _ in LIGHTS}
# Shown for a grating whose bake supports lamps only.
NO_SAMPLE_SET = "only lamps light it, because its bake has no .lobes.exr file; bake it with the ensemble model"


class Grating(bpy.types.PropertyGroup):
    """A height map and its bake."""

    name: StringProperty(
        name="Name",
        description="Name of the grating. Its material and node group follow it, unless you renamed them yourself",
        update=lambda grating, _: follow_name(grating),
    )
    source: StringProperty(
        name="Height Map",
        description="File of the scan, sample:NAME for a built-in sample, or grating:KIND?PARAMETERS",
    )
    size_um: FloatProperty(
        name="Width", description="Width of the scan in micrometres; 0 uses the width in the file", min=0
    )
    height_nm: FloatProperty(
        name="Height", description="Height from black to white in nanometres; 0 uses the heights in the file", min=0
    )
    channel: StringProperty(name="Channel", description="Channel of the file to read; empty for its topography")
    summary: StringProperty(name="Summary", description="Size, relief and strongest period of the scan")
    quality: StringProperty(name="Quality", description="Rating of the scan, and a line for each thing that limits it")
    steps: CollectionProperty(
        type=LevellingStep, name="Levelling", description="Steps that level and repair the scan, in order"
    )
    active_step: IntProperty(name="Active Step", description="Step whose settings are shown")
    delta_e: FloatProperty(
        name="Colour Error",
        description="How far the bake's colours may differ from the exact ones under lamps as small as the sun, in "
        "units of CIEDE2000: the eye hardly sees 1. Smaller takes longer and needs more memory. Single views (1 % of "
        "the directions) may differ more. Under large lamps the error is larger; the bake states it",
        default=1.0, min=1e-3, max=100.0, soft_min=0.05, soft_max=10.0,
    )  # fmt: skip
    coherence_um: FloatProperty(
        name="Coherence",
        description="Width over which light waves interact (coherence length), in micrometres. Larger gives purer "
        "colours, but also speckle if the scan is small. 0: chosen from the scan's size",
        default=0.0, min=0.0, max=1e4, soft_max=65.0,
    )  # fmt: skip
    spread_deg: FloatProperty(
        name="Direction Spread",
        description="How far the direction of the skin varies within the light spot or pixel, in degrees (standard "
        "deviation). Smooths the rays that one small scan shows, and widens its colours sideways. 0: one direction",
        default=0.0, min=0.0, max=45.0, soft_max=10.0,
    )  # fmt: skip
    illuminant: StringProperty(
        name="Lamp Spectrum",
        description="Light whose spectrum the bake splits into colours: tungsten, 2700K, D5500, LED-B1, FL11, 589nm, "
        "or a file of wavelengths (nm) and powers. Give your lamps its colour. Empty: daylight, for all lamps",
        update=lambda grating, _: keep_file(grating),
        search=lambda _, __, typed: known_names(typed),
        search_options={"SUGGESTION"},
    )
    matter: EnumProperty(name="Matter", description="What the surface is made of", items=MATTERS)
    layers: StringProperty(
        name="Layers",
        description="Films from the outside inwards as INDEX/THICKNESS, then the substrate. For example "
        "1.46/200nm, aluminium or 6x(1.68/80nm, 1.56/90nm), 1.56",
        default="6x(1.68/80nm, 1.56/90nm), 1.56",
    )
    plate_ior: FloatProperty(
        name="Plate IOR",
        description="How strongly a clear plate over the relief bends light (IOR): 1.585 for the plastic of a disc, "
        "about 1.5 for the lacquer of a foil. 1: no plate",
        default=PLATE_IORS[0], min=PLATE_IORS[0], max=PLATE_IORS[1],
    )  # fmt: skip
    request: StringProperty(
        name="Request",
        description="Further settings of the bake, as JSON; empty for the defaults",
        options={"HIDDEN"},
    )
    bake_path: StringProperty(
        name="Bake",
        description="File of the baked table",
        subtype="FILE_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )
    asked: StringProperty(
        name="Asked", description="Settings of the present bake, as JSON; empty if unknown", options={"HIDDEN"}
    )
    bake_summary: StringProperty(name="Bake Summary", description="Measured error and size of the bake")
    for_scene: BoolProperty(
        name="For This Scene", description="The bake holds only the directions that the scene needs", options={"HIDDEN"}
    )
    shadows: BoolProperty(
        name="Shadows",
        description="Objects cast shadows on the diffraction: all objects in Cycles, objects on screen in EEVEE. "
        "Before Blender 5.1 this works only in Cycles with Open Shading Language",
        default=True,
    )
    footprint: BoolProperty(
        name="Footprint",
        description="Blur colours that are finer than a pixel. The blur shrinks as samples accumulate. It lowers noise "
        "in Cycles and flicker in EEVEE, and costs render time. Switch it off for discs and close-ups",
        default=True,
    )
    every_lamp: BoolProperty(
        name="Every Lamp",
        description="Each sample shows the light of every lamp. Without it, a scene of four lamps and more shows the "
        "strongest and one of the others, drawn at random, in each sample: faster, with next to no noise",
    )
    lights: EnumProperty(name="Lights", description="Which lights the diffraction shows", items=LIGHTS)
    frame_kind: EnumProperty(
        name="Direction", description="What the scan's x axis (left to right) follows", items=KINDS
    )
    frame_uv_map: StringProperty(name="UV Map", description="UV map whose U the scan's x axis (left to right) follows")
    frame_axis: EnumProperty(name="Axis", description="Axis of the object", items=AXES, default="Z")
    frame_map: PointerProperty(
        type=bpy.types.Image, name="Direction Map", description="Picture made by Bake Direction Map"
    )
    frame_angle: StringProperty(
        name="Object Angle", description="Custom property that turns the scan on its object, in radians; empty for none"
    )
    look: PointerProperty(type=MaterialLook, name="Look", description="What a new material begins with")
    group: PointerProperty(type=bpy.types.ShaderNodeTree, name="Node Group", description="Group made from the bake")
    material: PointerProperty(type=bpy.types.Material, name="Material", description="Material made from the bake")

    @property
    def levelling(self) -> str:
        """The steps as one text in the form of `--level`: "plane,scars,dust:5", or "none"."""
        from ...precompute.surface.steps.pipeline import NONE

        return ",".join(step.text for step in self.steps) or NONE

    @levelling.setter
    def levelling(self, text: str) -> None:
        """Set the steps. Raises GratingError for an invalid text, and then changes nothing."""
        from ...precompute.surface.steps.pipeline import parse_steps

        steps = parse_steps(text, f"{self.name}: Levelling")
        self.steps.clear()
        for step in steps:
            self.steps.add().text = step.text
        self.active_step = min(self.active_step, max(len(steps) - 1, 0))

    @property
    def lit_by(self) -> str:
        """The chosen lights, one of CHOICES; the default if the file holds another value."""
        return stored.choice(self.lights, CHOICES, REST)

    @property
    def own_group(self) -> bpy.types.ShaderNodeTree | None:
        """The node group if it can be changed; None if there is none or it is linked from another file."""
        return None if self.group is None or self.group.library is not None else self.group

    def baked_file(self) -> Path:
        """The path of the bake's file. Raises GratingError if there is none."""
        if not self.bake_path:
            raise GratingError(self.name, "not baked yet", "press Bake Grating first")
        path = Path(absolute(self.bake_path))
        if not is_there(path):
            told = pure(self.bake_path)
            place = "the cache" if path.is_relative_to(cache_folder()) else f"the folder {told.parent.name}"
            remedy = "press Bake Grating again" if self.source else "load it again, or import the height map"
            raise GratingError(self.name, f"its bake {told.name} is gone from {place}", remedy)
        return path

    def source_file(self) -> str:
        """The height map as precompute reads it: an absolute path, or the name of a synthetic surface.

        Raises GratingError if there is none, as for a grating that was made from a bake alone."""
        if not self.source:
            raise GratingError(self.name, "made from a bake, without a height map", "import the height map to bake it")
        from ...precompute.surface.height_map import is_synthetic

        return self.source if is_synthetic(self.source) else absolute(self.source)

    def scan(self) -> dict[str, Any]:
        """The record of the grating's own scan, the first of a request. Raises GratingError as source_file does."""
        return scan_record(self.source_file(), self.size_um, self.height_nm, channel=self.channel)

    def further_scans(self) -> list[dict[str, Any]]:
        """The records of the further scans that are averaged with it. Raises GratingError if `request` is damaged."""
        return self._kept().get("scans", [])

    def _kept(self) -> dict[str, Any]:
        """The parsed content of `request`."""
        from ...precompute.base.strict import parse_json

        kept = parse_json(self.request or "{}", self.name, "import the height map again", part="its request: ")
        if not isinstance(kept, dict) or not isinstance(kept.get("scans", []), list):
            raise GratingError(self.name, "its saved request is damaged", "import the height map again")
        return kept

    def bake_request(self) -> "BakeRequest":
        """All settings of the bake, from the panel's fields and `request`. Raises GratingError for invalid values."""
        from ...precompute.bake.request import request_from
        from ...precompute.surface.steps.pipeline import steps_of

        shown = {
            "scans": [self.scan(), *self.further_scans()],
            "delta_e": _decimal(self.delta_e, 6),
            "coherence_um": _decimal(self.coherence_um, 6),
            "spread_deg": _decimal(self.spread_deg, 6),
            "matter": matter_text(self),
            **({"illuminant": illuminant_text(self)} if self.illuminant else {}),
            "levelling": [step.text for step in steps_of([s.text for s in self.steps], f"{self.name}: Levelling")],
        }
        return request_from(self._kept() | shown, self.name)

    def frame_source(self) -> DirectionSource:
        """The source of the scan's direction; the default if the chosen direction map was deleted."""
        held = {
            "kind": self.frame_kind,
            "uv_map": self.frame_uv_map,
            "axis": self.frame_axis,
            "angle": self.frame_angle,
            "combed": self.frame_kind == STORED and file_has_comb(),
        }
        return DirectionSource.from_property(held | {"frame_map": self.frame_map})

    def settings(self) -> dict[str, Any]:
        """The settings of its Diffraction group (materials/group_properties.py)."""
        return {
            "shadows": self.shadows, "lights": self.lit_by, "frame": self.frame_source(),
            "footprint": self.footprint, "every_lamp": self.every_lamp,
        }  # fmt: skip

    def take_frame_source(self, source: DirectionSource) -> None:
        """Set the source of the scan's direction."""
        self.frame_kind, self.frame_uv_map, self.frame_axis = source.kind, source.uv_map, source.axis
        self.frame_map, self.frame_angle = source.frame_map, source.angle

    def take_request(self, request: "BakeRequest") -> None:
        """Set all fields from a request. Values that the panel does not show go into `request`."""
        record = request_record(request)
        first, *others = record.pop("scans")
        self.source, self.channel = first["source"], first["channel"] or ""
        self.size_um, self.height_nm = first["size_um"] or 0.0, first["height_nm"] or 0.0
        self.delta_e, self.coherence_um = record.pop("delta_e"), record.pop("coherence_um") or 0.0
        self.spread_deg = record.pop("spread_deg", None) or 0.0
        illuminant = record.pop("illuminant")
        self.illuminant = "" if illuminant == DAYLIGHT else illuminant
        take_matter(self, record.pop("matter"))
        self.levelling = ",".join(record.pop("levelling")) or "none"
        self.request = json.dumps(record | {"scans": others}, sort_keys=True)

    def take_needs(self, needs: "Needs") -> None:
        """Restrict further bakes to what a scene needs. Raises GratingError as bake_request does."""
        record = request_record(replace(self.bake_request(), needs=needs))
        self.request = json.dumps(json.loads(self.request or "{}") | {"needs": record["needs"]}, sort_keys=True)


class SceneGratings(bpy.types.PropertyGroup):
    """All gratings of a scene, and which one is active."""

    items: CollectionProperty(type=Grating)
    active_index: IntProperty(name="Active Grating", description="Grating that the buttons work on")

    map_size: IntProperty(
        name="Map Size", description="Side of direction maps and of textures, in pixels", default=1024, min=16,
        max=1 << 15,
    )  # fmt: skip
    map_padding: IntProperty(
        name="Padding", description="Space between the islands of a UV map, in pixels", default=4, min=0, max=256
    )
    map_density: FloatProperty(
        name="Density", description="Pixels of the UV map per metre of the surface. 0: as many as fit", min=0.0,
        max=1e9,
    )  # fmt: skip

    def active(self) -> Grating | None:
        """The grating that the panel shows, or None."""
        if 0 <= self.active_index < len(self.items):
            return self.items[self.active_index]
        return None


def active_grating(scene: bpy.types.Scene) -> Grating:
    """The scene's active grating. Raises GratingError if there is none."""
    grating = scene.natural_gratings.active()
    if grating is None:
        raise GratingError(f"scene {scene.name}", "no grating in it", "import a height map first")
    return grating


def unused_name(name: str, taken: set[str]) -> str:
    """The name, with a number appended as Blender does if it is taken. A finished bake finds its grating by name."""
    candidates = (name, *(f"{name}.{number:03}" for number in range(1, len(taken) + 1)))
    return next(c for c in candidates if c not in taken)


def scan_record(source: str, size_um: float, height_nm: float, *, channel: str) -> dict[str, Any]:
    """The record of a scan for a request, made from the fields of the panel or a dialog."""
    sizes = {"size_um": _decimal(size_um, 7), "height_nm": _decimal(height_nm, 7)}
    return {"source": source, **sizes, "channel": channel or None}


def request_record(request: "BakeRequest") -> dict[str, Any]:
    """A request as JSON, with the folders of its scans. Valid on this machine only."""
    record = request.as_dict() | {"scans": [asdict(scan) for scan in request.scans]}
    # Rounding restores the numbers that the user typed from metres and radians, so that the cache key is the same.
    record["coherence_um"] = _decimal(record["coherence_um"] or 0.0, 12)
    record["needs"]["light_radius_deg"] = _decimal(record["needs"]["light_radius_deg"], 12) or 0.0
    return record


def _decimal(value: float, digits: int) -> float | None:
    """A number rounded to `digits` significant digits, to remove single-precision error; None for 0 (automatic)."""
    return float(f"{value:.{digits}g}") if value else None


NOISE, ATTRIBUTE = "NOISE", "ATTRIBUTE"
# Identifier, label and tooltip, as in Blender's enumerations.
PATTERNS = (
    (NOISE, "Noise", "In random patches that blend into each other"),
    (ATTRIBUTE, "Attribute", "By an attribute of the mesh from 0 to 1: one that you painted, or scale_random of "
     "Add > Mesh > Snake, one number per scale"),
)  # fmt: skip

# More further gratings than the interface or the command line offers.
_SHARES_MAX = 8


@dataclass(frozen=True)
class Variation:
    """A chosen variation.

    shares     share of the surface of each further grating; the first grating has the rest
    pattern    one of PATTERNS: how the gratings are distributed
    attribute  of ATTRIBUTE: its name
    softness   width of the transition between gratings, as a share of the surface
    turn       largest turn of the direction to either side, in radians
    size_m     width of the patches of NOISE and of the turns, in the object's space, in metres"""

    shares: tuple[float, ...] = ()
    pattern: str = NOISE
    attribute: str = ""
    softness: float = 0.0
    turn: float = 0.0
    size_m: float = 1.0

    @property
    def pattern_attribute(self) -> str:
        """The name of the attribute that distributes the gratings; empty for none."""
        return self.attribute if self.shares and self.pattern == ATTRIBUTE else ""

    def of_others(self, count: int) -> "Variation":
        """The variation with at most `count` further gratings; the first grating takes over the other shares."""
        return replace(self, shares=self.shares[:count])

    @property
    def summary(self) -> str:
        """A short description of the variation."""
        told = []
        if self.shares:
            told.append(" + ".join(f"{share:.0%}" for share in (1.0 - sum(self.shares), *self.shares)))
        if self.turn:
            told.append(translated("turned by {angle}", angle=f"{degrees(self.turn):.3g}°"))
        return ", ".join(told) or translated("None")

    def as_property(self) -> dict[str, Any]:
        """The variation as a value for a custom property."""
        return asdict(self) | {"shares": [float(share) for share in self.shares]}

    @classmethod
    def from_property(cls, held: stored.Record | None) -> "Variation":
        """The variation stored in a custom property; no variation if there is none."""
        if held is None:
            return cls()
        shares = stored.some_numbers(held, "shares", _SHARES_MAX)
        is_sound = all(share >= 0 for share in shares) and sum(shares) <= 1.0 + 1e-6
        return cls(
            shares=shares if is_sound else (),
            pattern=stored.choice(held.get("pattern"), (NOISE, ATTRIBUTE), NOISE),
            attribute=stored.text(held, "attribute"),
            softness=stored.number(held, "softness", low=0.0),
            turn=stored.number(held, "turn"),
            size_m=stored.number(held, "size_m", 1.0, low=1e-9),
        )
