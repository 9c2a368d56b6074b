# SPDX-License-Identifier: GPL-3.0-or-later
"""Wrong custom properties and grating fields: wrong types, lengths and values, by hand or from other tools."""

from collections.abc import Callable
from functools import partial

from .lying_scene import Skin

Lie = Callable[[Skin], None]
# The custom properties, each with its owner.
_HELD: dict[str, Callable[[Skin], object]] = {
    "ng_key_0_place": lambda it: it.scene,
    "ng_key_0_power": lambda it: it.scene,
    "ng_key_0_on": lambda it: it.scene,
    "ng_world_0_place": lambda it: it.scene,
    "ng_world_0_power": lambda it: it.scene,
    "ng_world_fingerprint": lambda it: it.scene,
    "ng_world_missed": lambda it: it.scene,
    "ng_key_shown": lambda it: it.scene.view_layers["Other"],
    "ng_keys": lambda it: it.group,
    "ng_shadows": lambda it: it.group,
    "ng_lights": lambda it: it.group,
    "ng_sources": lambda it: it.group,
    "ng_left_out": lambda it: it.group,
    "natural_gratings_counts": lambda it: it.sun,
    "ng_frame": lambda it: it.second.group,
    "ng_variation": lambda it: it.group,
    "ng_footprint": lambda it: it.group,
    "ng_every_lamp": lambda it: it.group,
    "ng_areas": lambda it: it.group,
    "ng_own": lambda it: it.group,
    "ng_region": lambda it: it.response.group,
    "ng_space": lambda it: it.response.group,
    "ng_pictures": lambda it: it.response.group,
    "ng_shared": lambda it: it.addon.lamp_group.lamp_group(),
    "ng_picture": lambda it: it.picture,
    "ng_picture_bytes": lambda it: it.picture,
    "ng_frame_map": lambda it: it.frame_map,
    "ng_wavelengths": lambda it: _wavelengths(),
    "ng_emission_sampling": lambda it: it.material,
    "ng_use_bump_map_correction": lambda it: it.material,
    "ng_key_0_unlinked": lambda it: it.plane,
    "ng_fan": lambda it: it.diffraction_lamp.data,
}
_NAN, _INFINITE = float("nan"), float("inf")
_VALUES: dict[str, object] = {
    "a number": 7,
    "a text": "nonsense\n\u202e\x07",
    "no floats": [],
    "three floats": [1.0, 2.0, 3.0],
    "floats that are none": [_NAN, _INFINITE, -_INFINITE, 1e30],
    "six wild floats": [_NAN, 1e30, -1e30, 5.0, -5.0, 0.0],
    "many flags": [True] * 10000,
    "numbers for flags": [7, -3],
    "a record": {"kind": 5, "shares": "x", "uv_map": 3, "size_m": 0.0},
    "records": [{"a": 1}, {"b": 2}],
    "infinite": _INFINITE,
}
# Wrong values for single entries of records.
_ENTRIES = {
    ("ng_frame", "kind"): ("NONSENSE", 5, [1.0]),
    ("ng_frame", "axis"): ("Q", 5),
    ("ng_frame", "angle"): (3.0,),
    ("ng_frame", "uv_map"): (3.0, "no such map"),
    ("ng_frame", "combed"): ("yes", 7),
    ("ng_frame", "unknown"): (1,),
    ("ng_frame", "frame_map"): ("a text", 5),
    ("ng_variation", "shares"): ("x", [-1.0], [9.0], [_NAN], [0.1] * 100, 5),
    ("ng_variation", "pattern"): ("NONSENSE", 5),
    ("ng_variation", "attribute"): (5,),
    ("ng_variation", "softness"): (_NAN, "x"),
    ("ng_variation", "size_m"): (0.0, _NAN),
    ("ng_variation", "turn"): (_INFINITE, "x"),
    ("ng_variation", "unknown"): (1,),
}
_LONG = "x" * 100_000
_JSON = ("{", "[]", "5", "null", '{"scans": 5}', '{"scans": [5]}', '{"scans": [{"source": 5}]}', '{"needs": []}',
         '{"needs": {"u": [2, 1]}}', '{"unknown": 1}', "[" * 5000, '{"matter": 1e999}', "nonsense\n\u202e")  # fmt: skip
# Wrong values for a grating's fields.
_FIELDS: dict[str, tuple[object, ...]] = {
    "quality": ("purple", "\n", " \n\n", "good", "good\n" * 1000, "\u202enonsense"),
    "request": _JSON,
    "asked": ("{", "nonsense", _LONG),
    "bake_path": ("//nowhere.exr", "/dev/null", "/", "//", _LONG, "\u202e\n.exr", "//skin.blend"),
    "source": (
        "sample:nonsense",
        "sample:",
        "grating:",
        "grating:pits?x",
        "grating:blazed?duty=nan",
        "/dev/null",
        "/",
        _LONG,
        "\u202e\n",
        "//skin.blend",
    ),
    "channel": ("nonsense", _LONG),
    "summary": (", , ,\n", _LONG),
    "bake_summary": ("\n\n,", _LONG),
    "frame_uv_map": ("nonsense",),
    "frame_angle": ("nonsense", "location"),
    "size_um": (_NAN, _INFINITE, 1e-30),
    "height_nm": (_NAN, _INFINITE, 1e30),
    "delta_e": (_NAN, -1.0, 0.0),
    "coherence_um": (_NAN, -5.0),
    "spread_deg": (_NAN, 1e-3),
    "lights": (99, -1),
    "frame_kind": (99,),
    "frame_axis": (99,),
    "active_step": (99, -5),
}
_STEPS = ("", "nonsense", "plane:5", "dust:nan", "polynomial:99", _LONG, "plane,scars", "crop:1:2", "\u202e\n")


def _wavelengths():
    import bpy

    return bpy.data.images["Wavelengths D65"]


def _told(name: str, value: object, it: Skin) -> None:
    holder = _HELD[name](it)
    if value is None:
        holder.pop(name, None)
    else:
        if name in holder:
            del holder[name]
        holder[name] = value


def _entry(name: str, entry: str, value: object, it: Skin) -> None:
    record = _HELD[name](it)[name]
    if entry in record:
        del record[entry]
    record[entry] = value


def _field(name: str, value: object, it: Skin) -> None:
    raw = it.first
    if hasattr(raw, "bl_system_properties_get"):  # Blender 5.0 and later
        raw = raw.bl_system_properties_get(do_create=True)
    raw[name] = value


def _step(text: str, it: Skin) -> None:
    it.first.steps[0].text = text


def _pointer(name: str, find: Callable[[Skin], object], it: Skin) -> None:
    """Point a record's entry, or a property, to another kind of data-block."""
    holder, _, entry = name.partition(".")
    owner = _HELD[holder](it)
    if entry:
        owner[holder][entry] = find(it)
    else:
        owner[holder] = find(it)


def lies() -> dict[str, Lie]:
    """The wrong values by name."""
    found: dict[str, Lie] = {}
    names, kinds = list(_HELD), list(_VALUES)
    for number, name in enumerate(names):
        found[f"{name} deleted"] = partial(_told, name, None)
        for turn in (0, 4, 7):  # each type meets about every third property
            kind = kinds[(number + turn) % len(kinds)]
            found[f"{name} is {kind}"] = partial(_told, name, _VALUES[kind])
    for (name, entry), values in _ENTRIES.items():
        for value in values:
            found[f"{name}: {entry} is {str(value)[:20]}"] = partial(_entry, name, entry, value)
    for name, values in _FIELDS.items():
        for value in values:
            found[f"grating's {name} is {str(value)[:24]!r}"] = partial(_field, name, value)
    for text in _STEPS:
        found[f"a step is {text[:20]!r}"] = partial(_step, text)
    for name in ("ng_frame.frame_map", "ng_keys", "ng_variation"):
        found[f"{name} leads to a lamp"] = partial(_pointer, name, lambda it: it.sun)
        found[f"{name} leads to a picture"] = partial(_pointer, name, lambda it: it.picture)
    for value in (-5, 10**6, 2**31 - 1):
        found[f"ng_sources is {value}"] = partial(_told, "ng_sources", value)
    return found
