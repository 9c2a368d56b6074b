# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a grating takes T, the direction of the scan's x axis, from: the artist's choice. Saved .blend files hold these
names: they must stay."""

from dataclasses import dataclass
from typing import Any

import bpy

from ..blender import stored

STORED, UV_MAP, RADIAL, AXIS, FRAME_MAP = "STORED", "UV_MAP", "RADIAL", "AXIS", "FRAME_MAP"
# Name, label and tooltip, as Blender's enumerations want them.
KINDS = (
    (STORED, "Stored", "The direction stored by Comb Grating; without one, the U of the UV map that renders"),
    (UV_MAP, "UV Map", "The U of the UV map that you name, whichever map renders"),
    (RADIAL, "Radial", "The scan's x axis points away from an axis of the object, so that the tracks of a CD run round "
     "it. With a Rotation of 90 degrees the x axis itself runs round"),
    (AXIS, "Object Axis", "An axis of the object, laid on the surface"),
    (FRAME_MAP, "Direction Map", "The picture that Bake Direction Map made of the mesh"),
)  # fmt: skip
FRAMES = {name for name, _, _ in KINDS}
# What Comb Grating can follow, in the same form.
COMB_SOURCES = (
    ("TAIL", "Head to Tail", "Along the body from its thicker end, found by the shape alone"),
    ("STROKES", "Strokes and Curves", "Along annotations drawn on the mesh, and along the Grease Pencil and curve "
     "objects that are selected with it; smooth in between"),
    ("HAIR", "Hair", "Along the hair curves that grow on the mesh or are selected with it, from root to tip"),
    ("BONES", "Bones", "Along the nearest bones of the mesh's armature at rest, from head to tail"),
    ("X", "X Axis", "Along the object's X axis, laid on the surface"),
    ("Y", "Y Axis", "Along the object's Y axis, laid on the surface"),
    ("Z", "Z Axis", "Along the object's Z axis, laid on the surface"),
    ("UV", "UV Map", "Along the U of the UV map that renders, smooth across its seams"),
    ("COPY", "Copy of UV Map", "Exactly the U of the UV map that renders, with all its turns and seams"),
    ("SMOOTHEST", "Smoothest", "Whichever way has the fewest turns"),
)  # fmt: skip
AXES = (
    ("X", "X", "The object's X axis"),
    ("Y", "Y", "The object's Y axis"),
    ("Z", "Z", "The object's Z axis"),
)
# What gives a direction to a mesh that has none. The first two need no UV map.
DIRECTION_REMEDY = "press Comb Grating, or choose Object Axis as Direction, or unwrap it with U along the body"
# The UV map, each of whose faces is an island, and the attribute of corners in which Comb Grating stores a field
# (precompute/mesh/layout.py): T is the map's tangent, turned about the normal by the attribute's cosine and sine.
COMB_UV, COMB_TURN = "Grating", "grating_comb"
# The attribute of faces that is true where the field has no direction.
COMB_SINGULAR = "grating_singular"
# The custom property of a direction map's picture that holds the UV map and the mesh of which it was baked.
BAKED_OF = "ng_frame_map"


@dataclass(frozen=True)
class DirectionSource:
    """A choice: one of KINDS, and what it needs.

    uv_map     of UV_MAP: the map's name
    axis       of RADIAL and AXIS: one of AXES
    frame_map  of FRAME_MAP: the picture
    angle      the name of a custom property of objects that turns their scan, in radians; empty for none
    combed     of STORED: whether some mesh of the file has a comb. Without one its nodes are left out: EEVEE has no
               tangent, not even zero, of a UV map that a mesh lacks"""

    kind: str = STORED
    uv_map: str = ""
    axis: str = "Z"
    frame_map: bpy.types.Image | None = None
    angle: str = ""
    combed: bool = False

    @property
    def axis_vector(self) -> tuple[float, float, float]:
        """The axis as a unit vector of the object's space."""
        x, y, z = (float(name == self.axis) for name, _, _ in AXES)
        return x, y, z

    @property
    def named_uv_map(self) -> str:
        """The name of the UV map on which T rests; empty for the one that renders."""
        if self.kind == FRAME_MAP and self.frame_map is not None:
            return baked_of(self.frame_map)["uv_map"]
        return self.uv_map if self.kind == UV_MAP else ""

    def as_property(self) -> dict[str, Any]:
        """The choice as a custom property holds it."""
        held: dict[str, Any] = {"kind": self.kind, "uv_map": self.uv_map, "axis": self.axis, "angle": self.angle}
        held["combed"] = self.combed
        return held if self.frame_map is None else held | {"frame_map": self.frame_map}

    @classmethod
    def from_property(cls, held: stored.Record | None) -> "DirectionSource":
        """The choice that a custom property holds; the default where there is none, or its picture is gone."""
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
    """Whether Comb Grating has stored a field on some mesh of the file."""
    return any(COMB_TURN in mesh.attributes for mesh in bpy.data.meshes)


def is_frame_map(image: bpy.types.Image | None) -> bool:
    """Whether a picture is one that Bake Direction Map made."""
    return image is not None and bool(baked_of(image))


def baked_of(image: bpy.types.Image) -> dict[str, str]:
    """The names of the UV map and of the mesh of which a direction map was baked, and the fingerprint of both; empty
    for another picture."""
    held = stored.record(image, BAKED_OF)
    noted = {name: stored.text(held, name) for name in ("uv_map", "mesh", "fingerprint")} if held is not None else {}
    return noted if noted and noted["uv_map"] else {}
