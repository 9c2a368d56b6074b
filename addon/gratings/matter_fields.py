# SPDX-License-Identifier: GPL-3.0-or-later
"""The fields of a grating for its matter and for the spectrum of its light, and their texts on the command line."""

from dataclasses import replace
from typing import Protocol

from ...precompute.base.failure import GratingError
from ...precompute.reflectance.metals import METALS
from ..blender.paths import absolute

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


class Fields(Protocol):
    """The part of a grating that says what it is made of."""

    name: str
    matter: str
    layers: str
    plate_ior: float


def matter_text(grating: Fields) -> str:
    """The matter in the form of `--matter`. Raises GratingError for layers that are not valid."""
    from ...precompute.reflectance.matter_text import parse

    if not grating.matter:  # a file of another version may hold no item of the menu
        return ""
    try:
        matter = parse(grating.layers if grating.matter == LAYERS else grating.matter)
    except GratingError as error:
        raise error.within(f"{grating.name}: Layers") from error
    # A text of layers may name its own plate.
    with_plate = matter.baked and not matter.has_plate
    return str(replace(matter, plate_ior=float(f"{grating.plate_ior:.{_DIGITS}g}")) if with_plate else matter)


def take_matter(grating: Fields, text: str) -> None:
    """Set the fields from a matter in the form of `--matter`."""
    from ...precompute.reflectance.matter_text import parse

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
