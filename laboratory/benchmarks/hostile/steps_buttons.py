# SPDX-License-Identifier: GPL-3.0-or-later
"""Every operator of the extension with random arguments, for random sessions (steps_session.py)."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from random import Random

from precompute.presets.presets import FOLDER, preset_names
from precompute.surface.samples.catalogue import SAMPLES
from precompute.surface.steps.pipeline import KINDS

from .shader_editor import shader_editor

# The scan of lying_scene.py, and a colour error at which it bakes in a moment.
SIZE_UM, HEIGHT_NM, DELTA_E = 4.0, 100.0, 6.0
# The presets whose show has a mesh of a few faces. A snake costs seconds.
_QUICK_SHOWS = ("cd", "record", "silver_foil", "mother_of_pearl")
_PRESET_FILES = [str(FOLDER / f"{name}.json") for name in preset_names()]
# The fewest faces that a snake can have.
_FACES = 11_000


@dataclass(frozen=True)
class Hand:
    """Where arguments come from: the random numbers, and the file of a scan that bakes in a moment."""

    random: Random
    scan: Path

    def item(self, operator: str, name: str) -> str:
        """A random item of an operator's enumeration."""
        import bpy

        described = getattr(bpy.ops.grating, operator).get_rna_type().properties[name]
        return self.random.choice([item.identifier for item in described.enum_items])

    def name_in(self, collection) -> str:
        """The name of a random data-block or grating; sometimes an empty or an unknown one."""
        return self.random.choice([*(each.name for each in collection), "", "nothing"])

    def share(self, most: float = 1.0) -> float:
        """A random number from 0 to `most`."""
        return self.random.choice((0.0, most, round(self.random.uniform(0.0, most), 3)))


Arguments = dict[str, object]


def _import(hand: Hand) -> Arguments:
    if hand.random.random() < 0.5:
        return {"filepath": str(hand.scan), "size_um": SIZE_UM, "height_nm": HEIGHT_NM}
    return {"filepath": hand.random.choice((*(f"sample:{name}" for name in SAMPLES), "sample:nothing", "/nowhere.png"))}


def _add_grating(hand: Hand) -> Arguments:
    kind = hand.item("add_grating", "kind")
    return {"kind": kind, "period_um": round(hand.random.uniform(0.5, 5.0), 2), "seed": hand.random.randrange(9)}


def _add_preset(hand: Hand) -> Arguments:
    return {"preset": hand.random.choice(preset_names()), "assign": hand.random.random() < 0.6}


def _load_bake(hand: Hand) -> Arguments:
    import bpy

    paths = [grating.bake_path for grating in bpy.context.scene.natural_gratings.items if grating.bake_path]
    return {"filepath": hand.random.choice((*paths, str(hand.scan), "/nowhere.exr"))}


def _add_grating_node(hand: Hand) -> Arguments:
    import bpy

    return {"grating": hand.name_in(bpy.context.scene.natural_gratings.items)}


def _vary(hand: Hand) -> Arguments:
    import bpy

    items = bpy.context.scene.natural_gratings.items
    return {
        "second": hand.name_in(items), "second_share": hand.share(), "third": hand.name_in(items),
        "third_share": hand.share(), "pattern": hand.item("vary", "pattern"), "softness": hand.share(),
        "turn": hand.share(1.5),
    }  # fmt: skip


def _direction(hand: Hand) -> Arguments:
    import bpy

    return {
        "kind": hand.item("direction", "kind"), "axis": hand.item("direction", "axis"),
        "uv_map": hand.random.choice(("", "UVMap", "nothing")), "frame_map": hand.name_in(bpy.data.images),
        "angle": hand.random.choice(("", "grating_angle")),
    }  # fmt: skip


def _diffraction_lamp(hand: Hand) -> Arguments:
    import bpy

    return {"size_mm": hand.random.choice((1.0, 10.0, 500.0)), "lamp": hand.name_in(bpy.context.scene.objects)}


def _lamp(hand: Hand) -> str:
    import bpy

    return hand.name_in([thing for thing in bpy.context.scene.objects if thing.type == "LIGHT"])


def _snake(hand: Hand) -> Arguments:
    held = {name: hand.item("add_snake", name) for name in ("species", "pose")}
    return held | {"faces": _FACES, "bones": hand.random.random() < 0.3}


def _sticker(hand: Hand) -> Arguments:
    return {"filepath": hand.random.choice(("", "", str(hand.scan), "/nowhere.png")), "size": hand.share(2.0)}


def _map(hand: Hand) -> Arguments:
    return {"size": hand.random.choice((16, 64)), "read": hand.random.random() < 0.8}


def _one(operator: str, name: str) -> Callable[[Hand], Arguments]:
    """Draw an operator's only argument."""
    return lambda hand: {name: hand.item(operator, name)}


def _none(_: Hand) -> Arguments:
    return {}


# The arguments of each operator, and how often it is pressed.
BUTTONS: dict[str, tuple[int, Callable[[Hand], Arguments]]] = {
    "import_height_map": (4, _import),
    "add_grating": (2, _add_grating),
    "add_preset": (6, _add_preset),
    "add_grating_node": (3, _add_grating_node),
    "add_preset_node": (1, lambda hand: {"preset": hand.random.choice(preset_names())}),
    "add_pattern_node": (2, _one("add_pattern_node", "pattern")),
    "show_me": (2, lambda hand: {"preset": hand.random.choice(_QUICK_SHOWS)}),
    "back_from_show": (1, _none),
    "load_bake": (2, _load_bake),
    "load_preset": (2, lambda hand: {"filepath": hand.random.choice((*_PRESET_FILES, "/nowhere.json"))}),
    "make_assets": (1, lambda hand: {"presets": "unknown"}),
    "remove_assets": (1, lambda hand: {"directory": "/nowhere"}),
    "show_picture": (2, _one("show_picture", "kind")),
    "remove": (2, _none),
    "add_step": (2, lambda hand: {"kind": hand.random.choice(list(KINDS))}),
    "remove_step": (2, _none),
    "move_step": (2, _one("move_step", "direction")),
    "steps_as_text": (1, lambda hand: {"steps": hand.random.choice(("", "none", "plane,scars", "nonsense"))}),
    "bake": (5, _none),
    "cancel": (1, lambda hand: {"follower": hand.random.choice(("grating.bake", "grating.comb", ""))}),
    "needs": (2, lambda hand: {"everything": hand.random.random() < 0.3}),
    "new_material": (3, _none),
    "assign": (7, _none),
    "add_diffraction": (6, _none),
    "remove_diffraction": (3, _none),
    "mend": (3, _none),
    "adopt": (3, _none),
    "add_sun": (2, _none),
    "add_sky_sun": (1, _none),
    "add_diffraction_lamp": (3, _diffraction_lamp),
    "light_rig": (3, lambda hand: {"kind": hand.item("light_rig", "kind"), "softness": hand.random.choice((0.1, 1.0))}),
    "add_snake": (1, _snake),
    "add_shed_skin": (1, lambda hand: {"species": hand.item("add_shed_skin", "species"), "faces": _FACES}),
    "add_sticker": (2, _sticker),
    "lights": (3, _one("lights", "lights")),
    "count_lamp": (3, lambda hand: {"lamp": _lamp(hand)}),
    "choose_quality": (2, _one("choose_quality", "quality")),
    "comb": (3, _one("comb", "source")),
    "direction": (3, _direction),
    "vary": (4, _vary),
    "hologram": (4, lambda hand: {"pattern": hand.item("hologram", "pattern"), "filepath": str(hand.scan)}),
    "paint": (2, lambda hand: {"input": hand.item("paint", "input"), "by": hand.item("paint", "by")}),
    "unpaint": (2, _one("unpaint", "input")),
    "fit_world": (1, _none),
    "fit_frames": (1, lambda hand: {"last": 2}),
    "osl_reference": (3, _one("osl_reference", "method")),
    "show_direction": (1, _none),
    "unwrap": (2, lambda hand: {"size": 64, "method": hand.item("unwrap", "method")}),
    "bake_direction_map": (2, _map),
    "why_black": (3, _none),
    "mend_cause": (5, _one("mend_cause", "action")),
}
# The operators that bake or transform the active grating's scan.
_BAKING = ("bake", "needs", "osl_reference")
_IN_SHADER_EDITOR = ("add_grating_node", "add_preset_node", "add_pattern_node")


def press(name: str, hand: Hand) -> tuple[str, Callable[[], object]]:
    """An operator's call with drawn arguments, as text and as a function. Before a bake, a grating that bakes in a
    moment becomes active."""
    import bpy

    if name in _BAKING:
        _choose_quick(hand.scan)
    given = BUTTONS[name][1](hand)
    told = ", ".join(f"{key}={value!r}" for key, value in given.items())
    around = shader_editor if name in _IN_SHADER_EDITOR else nullcontext
    return f"grating.{name}({told})", lambda: _call(getattr(bpy.ops.grating, name), given, around)


def _call(operator: Callable[..., object], given: Arguments, around: Callable[[], AbstractContextManager]) -> object:
    with around():
        return operator(**given)


def _choose_quick(scan: Path) -> None:
    """Make a grating active that bakes in a moment. It is imported if there is none."""
    import bpy

    gratings = bpy.context.scene.natural_gratings
    quick = [index for index, each in enumerate(gratings.items) if each.source == str(scan) and each.delta_e >= 1.0]
    if not quick:
        bpy.ops.grating.import_height_map(filepath=str(scan), size_um=SIZE_UM, height_nm=HEIGHT_NM)
        quick = [gratings.active_index]
    gratings.active_index = quick[0]
    gratings.active().delta_e = DELTA_E
    gratings.active().coherence_um = 0.0
    gratings.active().matter = "DIELECTRIC"
