# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a grating takes T from, the direction of the scan's x axis. Saved files contain these names: keep them."""

from typing import Any, NamedTuple

import bpy

from ..blender import stored

STORED, UV_MAP, RADIAL, AXIS, FRAME_MAP = "STORED", "UV_MAP", "RADIAL", "AXIS", "FRAME_MAP"
# Identifier, label and tooltip, as in Blender's enumerations.
KINDS = (
    (STORED, "Stored", "Direction stored by Comb Grating; without one, the U of the UV map that renders"),
    (UV_MAP, "UV Map", "U of the UV map that you name, even if another map renders"),
    (RADIAL, "Radial", "The scan's x axis points away from an axis of the object, so that the tracks of a CD run "
     "around it. With a Rotation of 90 degrees the x axis itself runs around"),
    (AXIS, "Object Axis", "An axis of the object, projected onto the surface"),
    (FRAME_MAP, "Direction Map", "Picture that Bake Direction Map made for the mesh"),
)  # fmt: skip
FRAMES = {name for name, _, _ in KINDS}
# What Comb Grating can follow, in the same form.
COMB_SOURCES = (
    ("TAIL", "Head to Tail", "Along the body from its thicker end, found from the shape alone"),
    ("STROKES", "Strokes and Curves", "Along annotations drawn on the mesh and along Grease Pencil and curve objects "
     "selected with it; smooth in between"),
    ("HAIR", "Hair", "Along hair curves that grow on the mesh or are selected with it, from root to tip"),
    ("BONES", "Bones", "Along the nearest bones of the mesh's armature at rest, from head to tail"),
    ("X", "X Axis", "Along the object's X axis, projected onto the surface"),
    ("Y", "Y Axis", "Along the object's Y axis, projected onto the surface"),
    ("Z", "Z Axis", "Along the object's Z axis, projected onto the surface"),
    ("UV", "UV Map", "Along the U of the UV map that renders, smooth across its seams"),
    ("COPY", "Copy of UV Map", "Exactly the U of the UV map that renders, with all its turns and seams"),
    ("SMOOTHEST", "Smoothest", "The direction that turns least over the surface"),
)  # fmt: skip
AXES = (
    ("X", "X", "The object's X axis"),
    ("Y", "Y", "The object's Y axis"),
    ("Z", "Z", "The object's Z axis"),
)
# How to give a mesh a direction. The first two remedies need no UV map.
DIRECTION_REMEDY = "press Comb Grating, or choose Object Axis as Direction, or unwrap it with U along the body"
# Comb Grating stores a field in this UV map, in which each face is an island, and this attribute of corners
# (precompute/mesh/layout.py). T is the map's tangent, turned about the normal by the attribute's cosine and sine.
COMB_UV, COMB_TURN = "Grating", "grating_comb"
# A face attribute, true where the field has no direction.
COMB_SINGULAR = "grating_singular"
# Custom property on the picture of a direction map: the UV map and the mesh that it was baked of.
BAKED_OF = "ng_frame_map"


class DirectionSource(NamedTuple):
    """The chosen source of T: one of KINDS, and its settings.

    uv_map     of UV_MAP: name of the map
    axis       of RADIAL and AXIS: one of AXES
    frame_map  of FRAME_MAP: the picture
    angle      name of an object's custom property that turns the scan, in radians; empty for none
    combed     of STORED: whether any mesh in the file has a comb. Without one the comb's nodes are left out, because
               EEVEE gives no tangent, not even zero, for a UV map that a mesh lacks"""

    kind: str = STORED
    uv_map: str = ""
    axis: str = "Z"
    frame_map: bpy.types.Image | None = None
    angle: str = ""
    combed: bool = False

    @property
    def axis_vector(self) -> tuple[float, float, float]:
        """The axis as a unit vector in the object's space."""
        x, y, z = (float(name == self.axis) for name, _, _ in AXES)
        return x, y, z

    @property
    def named_uv_map(self) -> str:
        """The name of the UV map that T follows; empty for the map that renders."""
        if self.kind == FRAME_MAP and self.frame_map is not None:
            return baked_of(self.frame_map)["uv_map"]
        return self.uv_map if self.kind == UV_MAP else ""

    def as_property(self) -> dict[str, Any]:
        """The source as a value for a custom property."""
        held: dict[str, Any] = {"kind": self.kind, "uv_map": self.uv_map, "axis": self.axis, "angle": self.angle}
        held["combed"] = self.combed
        return held if self.frame_map is None else held | {"frame_map": self.frame_map}

    @classmethod
    def from_property(cls, held: stored.Record | None) -> "DirectionSource":
        """The source stored in a custom property; the default if there is none, or if its picture was deleted."""
        if held is None:
            return cls()
        kind = stored.choice(held.get("kind"), FRAMES, STORED)
        picture = stored.block(held, "frame_map", bpy.types.Image)
        if kind == FRAME_MAP and not is_frame_map(picture):
            return cls()
        return cls(
            kind=kind,
            uv_map=stored.text(held, "uv_map"),
            axis=stored.choice(held.get("axis"), {name for name, _, _ in AXES}, "Z"),
            frame_map=picture,
            angle=stored.text(held, "angle"),
            combed=stored.flag(held, "combed"),
        )


def file_has_comb() -> bool:
    """Whether Comb Grating has stored a field on any mesh in the file."""
    return any(COMB_TURN in mesh.attributes for mesh in bpy.data.meshes)


def is_frame_map(image: bpy.types.Image | None) -> bool:
    """Whether a picture was made by Bake Direction Map."""
    return image is not None and bool(baked_of(image))


def baked_of(image: bpy.types.Image) -> dict[str, str]:
    """The UV map and the mesh that a direction map was baked of, and their fingerprint; empty for other pictures."""
    held = stored.record(image, BAKED_OF)
    noted = {name: stored.text(held, name) for name in ("uv_map", "mesh", "fingerprint")} if held is not None else {}
    return noted if noted and noted["uv_map"] else {}
