# SPDX-License-Identifier: GPL-3.0-or-later
"""The description of a method, known without building it.

Each module of this folder declares a MethodEntry for every method in it. method_registry.py collects the entries, and
the product's lists of methods are derived from them.
"""

from collections.abc import Callable
from dataclasses import dataclass

from ..surface.relief import Relief
from .method import Coherence, Method, Settings

# build(relief, settings): raises GratingError for a relief that the method cannot handle.
Build = Callable[[Relief, Settings], Method]


@dataclass(frozen=True)
class MethodEntry:
    """A method's name and capabilities.

    coherence    model of coherence; the method is compared with the reference of the same model
    build        makes the method for a relief
    in_maps      whether maps of it are offered; false if a map would take hours
    has_shader   whether an OSL shader evaluates it from images of its terms (Method.shader_images)
    """

    name: str
    coherence: Coherence
    build: Build
    in_maps: bool = True
    has_shader: bool = False
