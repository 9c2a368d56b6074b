# SPDX-License-Identifier: GPL-3.0-or-later
"""A cause of missing colours, and the button that removes it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

# Causes beside which nothing is wrong with the scene, and all that leave colours in the picture.
HARMLESS = {"DIRECTION_MAP", "CROWDED", "SAMPLES", "VIEW_TRANSFORM"}
_WARNINGS = {"FEW_COLOURS", "SCENE_LIGHTS", *HARMLESS}


@dataclass(frozen=True)
class Button:
    """An operator that removes a cause.

    operator    its identifier
    text        what it does, in a few words
    properties  values of its properties
    invoked     whether it is called as by a click: a bake then works in the background, and a light rig serves the view
                that the artist looks through"""

    operator: str
    text: str
    properties: Mapping[str, Any] = field(default_factory=dict)
    invoked: bool = False


@dataclass(frozen=True)
class Cause:
    """A cause of missing colours: its kind, a sentence for the artist, and a button if one can help."""

    kind: str
    sentence: str
    button: Button | None = None

    @property
    def is_warning(self) -> bool:
        """Whether it leaves colours in the picture."""
        return self.kind in _WARNINGS


def mend(action: str, text: str) -> Button:
    """The button that does an action of workflow/mending_causes.py."""
    return Button("grating.mend_cause", text, {"action": action})


def light_button() -> Button:
    """The button that lights the grating so that its colours reach the viewer."""
    return Button("grating.light_rig", "Place a Light Rig", {"kind": "SUN"}, invoked=True)
