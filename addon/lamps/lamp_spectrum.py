# SPDX-License-Identifier: GPL-3.0-or-later
"""The spectrum of a lamp: which row of the table of lamps (precompute/colour/lamp_table.py) it has.

A lamp with Blender's *Temperature* is a black body of this temperature, and a driver follows it. The property
`diffraction_spectrum` of a lamp names another spectrum: daylight, an LED, a tube, a line or a file. It belongs to the
lamp's data, beside the colour that goes with it. A lamp with neither is white, and its colour is a filter before it."""

import bpy
from bpy.props import StringProperty

from ...precompute.base.failure import GratingError
from ..blender.paths import absolute

# The name of the lamp's property.
FIELD = "diffraction_spectrum"
# The name of the field that the panel shows. It holds nothing of its own.
SHOWN = "diffraction_spectrum_shown"
_DESCRIPTION = (
    "The lamp's own spectrum, which a grating splits into colours: a lamp by name (warm-led, tube, sodium), LED-B1, "
    "FL11, D5500, 589nm, or a file of wavelengths (nm) and powers. It also sets the lamp's colour. 2700K sets its "
    "temperature. Empty: daylight"
)
# Custom property of a lamp's data: whether its colour came with its spectrum.
_COLOURED = "ng_coloured"
# The largest number of files' spectra in a .blend file.
FURTHER_MAX = 32


def spectrum_of(light: bpy.types.Light) -> str:
    """The canonical text of the spectrum that an artist chose for a lamp; "" without one, or for a text that names
    none."""
    text = getattr(light, FIELD, "")
    if not text:  # as in most files, which do not need the illuminants
        return ""
    from ...precompute.colour.illuminants import JOINT, is_illuminant

    return text if JOINT not in text and is_illuminant(text) else ""


def seen_spectrum(light: bpy.types.Light) -> str:
    """The canonical text of a lamp's spectrum in the present frame: the chosen one, or its temperature's; "" for a
    white lamp."""
    if text := spectrum_of(light):
        return text
    if not light.use_temperature:
        return ""
    from ...precompute.colour.illuminants import BLACK_BODY_K

    low, high = BLACK_BODY_K
    return f"{min(max(round(light.temperature), low), high)}K"


def further_spectra() -> list[str]:
    """The spectra of files that lamps of the .blend file have, in the order of their rows."""
    every = sorted({text for light in bpy.data.lights if ":" in (text := spectrum_of(light))})
    return every[:FURTHER_MAX]


def is_coloured(light: bpy.types.Light) -> bool:
    """Whether a lamp may have another spectrum than white."""
    return bool(light.use_temperature or _named(light))


def row_expression(light: bpy.types.Light) -> str:
    """An expression for a driver: the lamp's row. It reads `temperature`, and its switch as `heated`."""
    from ...precompute.colour.lamp_table import row_of, row_of_temperature

    if text := _named(light):
        return f"{row_of(text, further_spectra()):g}"
    return f"({row_of_temperature('temperature')}) if heated else 0"


def _named(light: bpy.types.Light) -> str:
    """The spectrum that an artist chose, if the table has a row for it."""
    text = spectrum_of(light)
    return text if ":" not in text or text in further_spectra() else ""


def spectrum_field() -> object:
    """The property of a lamp's data."""
    return StringProperty(  # type: ignore[func-returns-value]  # the stubs say it returns None
        name="Diffraction Spectrum",
        description=_DESCRIPTION,
        update=lambda light, _: take_spectrum(light),  # type: ignore[arg-type]  # the stubs know no owner
    )


def shown_field() -> object:
    """The property of a lamp's data that shows its spectrum, also one by its temperature, and sets it. Emptied, it
    leaves neither."""

    def take(light: bpy.types.Light, typed: str) -> None:
        if not typed:
            light.use_temperature = False
        setattr(light, FIELD, typed)

    return StringProperty(  # type: ignore[func-returns-value]  # the stubs say it returns None
        name="Diffraction Spectrum",
        description=_DESCRIPTION,
        get=lambda light: getattr(light, FIELD) or seen_spectrum(light),
        set=take,
        search=lambda _, __, typed: _names_with(typed),
        search_options={"SUGGESTION"},
    )


def _names_with(typed: str) -> list[str]:
    from ...precompute.colour.illuminants import names_with

    return names_with(typed)


def take_spectrum(light: bpy.types.Light) -> None:
    """After an artist has typed or chosen a spectrum: give the lamp its colour, and keep a file's spectrum in place of
    its path. A black body becomes Blender's own temperature, which can be animated. A text that names no spectrum
    stays, and the panel tells what is wrong with it. An emptied field leaves the lamp white if its colour came from
    here."""
    from ...precompute.colour.working_space import lamp_rgb
    from ..blender import compat

    typed = getattr(light, FIELD)
    try:
        text = canonical_spectrum(typed) if typed else ""
    except GratingError:
        return
    is_black_body = text.endswith("K")
    if (kept := "" if is_black_body else text) != typed:
        setattr(light, FIELD, kept)  # Blender calls this function again
    if not text:
        if light.pop(_COLOURED, None):
            light.color = (1.0, 1.0, 1.0)
        return
    light.use_temperature = is_black_body
    if is_black_body:
        light.temperature, light.color = int(text[:-1]), (1.0, 1.0, 1.0)
    else:
        light[_COLOURED], light.color = True, lamp_rgb(compat.working_space(), text).tolist()


def fault_of(light: bpy.types.Light) -> GratingError | None:
    """What is wrong with the text of a lamp's spectrum; None if nothing is."""
    text = getattr(light, FIELD, "")
    if not text or spectrum_of(light):
        return None
    try:
        canonical_spectrum(text)
    except GratingError as error:
        return error
    return None


def canonical_spectrum(typed: str) -> str:
    """The canonical text of one lamp's spectrum. Raises GratingError for a text that names none, for several parts, and
    for a damaged file."""
    from ...precompute.colour.illuminants import lamp_of

    return lamp_of(absolute(typed))
