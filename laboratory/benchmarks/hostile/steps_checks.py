# SPDX-License-Identifier: GPL-3.0-or-later
"""What must be true after each step of a random session (steps_session.py), and at its end."""

from collections.abc import Iterator
from types import SimpleNamespace

from ..handlers import Layout

# The data-blocks that undo restores.
KINDS = (
    "actions", "armatures", "cameras", "collections", "curves", "images", "lights", "materials", "meshes",
    "node_groups", "objects", "scenes", "texts", "worlds",
)  # fmt: skip
# The types of pictures that Blender makes for itself.
_OWN_PICTURES = ("RENDER_RESULT", "COMPOSITING")
Contents = dict[object, object]


class _Panel(Layout):
    """A stand-in for Blender's layout that reads the properties it is given. `folded`: sub-panels that are closed by
    default are not drawn."""

    def __init__(self, folded: bool) -> None:
        self._folded = folded

    def prop(self, data: object, name: str, **_: object) -> None:
        """Read a property, as Blender does to draw it."""
        getattr(data, name)

    def panel(self, _name: str, default_closed: bool = False) -> tuple[Layout, Layout | None]:
        """The header and the body of a sub-panel."""
        return self, None if default_closed and self._folded else self

    def panel_prop(self, data: object, name: str) -> tuple[Layout, Layout | None]:
        """The header and the body of a sub-panel whose property tells whether it is open."""
        return self, self if getattr(data, name) or not self._folded else None


def draw_panels(addon: SimpleNamespace) -> None:
    """Draw all panels and menus, folded and unfolded, and the lists of gratings and steps."""
    import bpy

    context = _context()
    lists = {cls.__name__: cls for cls in addon.package.CLASSES if issubclass(cls, bpy.types.UIList)}
    for folded in (True, False):
        for cls in addon.package.CLASSES:
            if issubclass(cls, bpy.types.Panel | bpy.types.Menu):
                cls.draw(SimpleNamespace(layout=_Panel(folded)), context)
    for grating in context.scene.natural_gratings.items:
        lists["GratingList"].draw_item(None, context, _Panel(True), None, grating, 0, None, "")
        for step in grating.steps:
            lists["StepList"].draw_item(None, context, _Panel(True), None, step, 0, None, "")


def _context() -> SimpleNamespace:
    """What panels read from Blender's context; in background there is no region, and the interface's scale is 0."""
    import bpy

    real = bpy.context
    return SimpleNamespace(
        region=SimpleNamespace(width=300), preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        scene=real.scene, view_layer=real.view_layer, window_manager=real.window_manager, space_data=None,
        active_object=real.active_object, selected_objects=real.selected_objects, object=real.object, mode=real.mode,
        evaluated_depsgraph_get=real.evaluated_depsgraph_get,
    )  # fmt: skip


def contents() -> Contents:
    """The names of the file's data-blocks, the materials of each object's slots, and the gratings of each scene."""
    import bpy

    held: Contents = {kind: tuple(sorted(each.name_full for each in getattr(bpy.data, kind))) for kind in KINDS}
    for thing in bpy.data.objects:
        held["slots", thing.name_full] = tuple(_name(slot.material) for slot in thing.material_slots)
    for scene in bpy.data.scenes:
        held["gratings", scene.name_full] = tuple(
            (each.name, _name(each.group), _name(each.material)) for each in scene.natural_gratings.items
        )
    return held


def differences(before: Contents, now: Contents) -> str:
    """A line with what came and went; empty if nothing did."""
    told = []
    for key in dict.fromkeys((*before, *now)):
        was, is_now = before.get(key, ()), now.get(key, ())
        if was != is_now:
            went, came = [each for each in was if each not in is_now], [each for each in is_now if each not in was]
            told.append(f"{key}: " + (f"- {went} + {came}" if went or came else f"{was} became {is_now}"))
    return "; ".join(told)


def faults() -> Iterator[str]:
    """Yield what is inconsistent in the file."""
    import bpy

    groups, materials = set(bpy.data.node_groups), set(bpy.data.materials)
    for scene in bpy.data.scenes:
        gratings = scene.natural_gratings
        if not 0 <= gratings.active_index < max(1, len(gratings.items)):
            yield f"{scene.name}: the active grating is {gratings.active_index} of {len(gratings.items)}"
        for each in gratings.items:
            if each.group is not None and each.group not in groups:
                yield f"{each.name}: its node group is not in the file"
            if each.material is not None and each.material not in materials:
                yield f"{each.name}: its material is not in the file"
            if len(each.steps) and not 0 <= each.active_step < len(each.steps):
                yield f"{each.name}: the active step is {each.active_step} of {len(each.steps)}"
    # The other scenes are brought up to date when they are shown, rendered or saved.
    yield from _driver_faults(bpy.context.scene)


def _driver_faults(scene) -> Iterator[str]:
    """Yield the drivers of the extension's properties that drive nothing or follow nothing."""
    for curve in scene.animation_data.drivers if scene.animation_data else ():
        if not curve.data_path.startswith('["ng_'):
            continue
        name = curve.data_path.split('"')[1]
        if name not in scene:
            yield f"{scene.name}: a driver of {name}, which the scene lacks"
        # A variable of the type CONTEXT_PROP follows the view layer, and has no data-block.
        variables = (each for each in curve.driver.variables if each.type != "CONTEXT_PROP")
        if any(target.id is None for variable in variables for target in variable.targets):
            yield f"{scene.name}: the driver of {name} follows nothing"


def leftovers() -> Iterator[str]:
    """Delete all gratings, objects and scenes but one, purge the file, and yield what of the extension's is left."""
    import bpy

    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    scene = bpy.context.scene
    bpy.data.batch_remove([other for other in bpy.data.scenes if other != scene])
    bpy.data.batch_remove(list(bpy.data.objects))
    scene.natural_gratings.items.clear()
    scene.natural_gratings.active_index = 0
    bpy.context.view_layer.update()
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    bpy.context.view_layer.update()
    for kind in ("images", "node_groups", "materials", "meshes", "lights", "cameras", "armatures", "texts"):
        for each in getattr(bpy.data, kind):
            # Blender's own pictures, and direction maps that nothing reads, which are kept for the artist.
            is_kept_map = kind == "images" and each.use_fake_user
            if getattr(each, "type", "") not in _OWN_PICTURES and not is_kept_map:
                yield f"{kind}: {each.name}, used by {bpy.data.user_map(subset={each})[each] or each.users}"
    yield from (f"{scene.name}: the property {name}" for name, _ in scene.items() if name.startswith("ng_key_"))
    yield from faults()


def _name(block: object) -> str:
    return "" if block is None else block.name_full
