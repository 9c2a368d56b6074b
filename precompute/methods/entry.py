# SPDX-License-Identifier: GPL-3.0-or-later
"""What the rest of the project knows of a method without building it.

Each module of this folder declares one MethodEntry for every method that it holds. registry.py collects the entries.
Every list of methods (the command line's, the maps', the evaluation's, the benchmark's) is derived from them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from ..surface.relief import Relief
from .method import Coherence, Method, Settings

# build(relief, settings): raises GratingError for a relief that the method cannot take.
Build = Callable[[Relief, Settings], Method]


class Extent(Protocol):
    """How much the benchmark tries.

    steps_nm   wavelength steps in nanometres
    delta_es   colour differences that bakes are asked to keep
    sweeps     whether single settings of a method are varied as well
    """

    steps_nm: tuple[float, ...]
    delta_es: tuple[float, ...]
    sweeps: bool


@dataclass(frozen=True)
class Trial:
    """One arrangement of a method that the benchmark tries.

    label     names the trial among the trials of the method
    changes   the fields of Settings that the trial changes, by name
    build     build(relief, settings, source) in place of the entry's own; `source` names the surface in error messages
    """

    label: str
    changes: Mapping[str, object] = field(default_factory=dict)
    build: Callable[[Relief, Settings, str], Method] | None = None


def no_trials(extent: Extent) -> Sequence[Trial]:
    """The trials of a method that the benchmark leaves out."""
    return ()


@dataclass(frozen=True)
class PlotStyle:
    """How a method is drawn: matplotlib's names of a colour and a marker; `first` puts it at the head of the legend."""

    colour: str
    marker: str
    first: bool = False


@dataclass(frozen=True)
class MethodEntry:
    """A method by its name, and what it can do.

    coherence             model of coherence; the method is compared with the reference of the same model
    build                 makes the method for a relief
    style                 colour and marker of its points in a plot
    is_reference          whether it is the exact answer of its model, which takes long
    has_spectrum          whether it has a density at each wavelength; a method without spectrum has colours alone
    has_units             whether its brightness means anything; if not, the benchmark fits it to the reference
    in_default_evaluation whether `evaluate` takes it where no methods are named
    in_maps               whether maps of it are offered; false where a map would take hours
    has_shader            whether an OSL shader evaluates it from images of its terms (Method.shader_images)
    trials                the trials that the benchmark makes of it
    """

    name: str
    coherence: Coherence
    build: Build
    style: PlotStyle
    is_reference: bool = False
    has_spectrum: bool = True
    has_units: bool = True
    in_default_evaluation: bool = False
    in_maps: bool = True
    has_shader: bool = False
    trials: Callable[[Extent], Sequence[Trial]] = no_trials
