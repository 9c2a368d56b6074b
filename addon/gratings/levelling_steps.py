# SPDX-License-Identifier: GPL-3.0-or-later
"""The steps that level and repair a scan, as the panel lists and edits them.

A step is stored as its text, as on the command line and in a bake's header. The panel reads the arguments from the text
and writes them back, so the panel and the command line cannot differ."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, StringProperty

from ...precompute.base.failure import GratingError

if TYPE_CHECKING:
    from ...precompute.surface.steps.step import Step

# The property that shows each argument, by the argument's name in precompute/surface/steps/pipeline.py.
ARGUMENTS = {
    "least-squares|robust": "fit",
    "median|difference": "by",
    "DEGREE": "degree",
    "K": "threshold",
    "DEG": "angle_deg",
    "LEFT": "left_um",
    "TOP": "top_um",
    "RIGHT": "right_um",
    "BOTTOM": "bottom_um",
    "NM": "length_nm",
    "FACTOR": "factor",
}
_FITS = (
    ("least-squares", "Least Squares", "Plane through all heights"),
    ("robust", "Robust", "Plane through all heights except dust"),
)
_BYS = (
    ("median", "Median", "Shift each scan line, left to right, to a median of zero"),
    ("difference", "Difference", "Shift each scan line to a median difference of zero from the line above"),
)


def _read(name: str) -> Callable[["LevellingStep"], float]:
    """A getter that reads an argument from a step's text. For an argument of words it returns the word's index."""

    def read(self: "LevellingStep") -> float:
        for argument, value in self._arguments():
            if ARGUMENTS[argument.name] == name:
                if isinstance(value, str):
                    return argument.words.index(value)
                return int(value) if argument.whole else value
        return 0

    return read


def _write(name: str) -> Callable[["LevellingStep", float], None]:
    """A setter that writes an argument into a step's text, limited to the range that the step allows."""

    def write(self: "LevellingStep", shown: float) -> None:
        values = [
            _taken(argument, shown) if ARGUMENTS[argument.name] == name else value
            for argument, value in self._arguments()
        ]
        if values:
            self.text = replace(self.step(), values=tuple(values)).text

    return write


def _taken(argument: Any, shown: float) -> float | str:
    """The value of an argument for a number from the panel, which has single precision."""
    words = getattr(argument, "words", None)
    return words[int(shown)] if words else min(argument.high, max(argument.low, float(f"{shown:.7g}")))


def _kept(name: str) -> dict[str, Callable[..., Any]]:
    return {"get": _read(name), "set": _write(name)}


class LevellingStep(bpy.types.PropertyGroup):
    """A levelling step and its arguments."""

    text: StringProperty(name="Step", description="Step in the form of the command line", options={"HIDDEN"})
    fit: EnumProperty(name="Fit", description="Heights that the plane is fitted to", items=_FITS, **_kept("fit"))
    by: EnumProperty(name="By", description="What becomes zero in each scan line", items=_BYS, **_kept("by"))
    degree: IntProperty(
        name="Degree", description="Degree of the polynomial in x and y", min=1, max=5, **_kept("degree")
    )
    threshold: FloatProperty(
        name="Threshold",
        description="How far heights must stand out to count as a defect: for scars, in rms differences of scan lines; "
        "for outliers and dust, in standard deviations. Lower values remove more",
        min=0.1, soft_max=20.0, **_kept("threshold"),
    )  # fmt: skip
    angle_deg: FloatProperty(
        name="Angle (deg)",
        description="Turns the scan counterclockwise, in degrees",
        min=-360,
        max=360,
        **_kept("angle_deg"),
    )
    left_um: FloatProperty(
        name="Left (um)", description="From the scan's left edge, in micrometres", min=0, **_kept("left_um")
    )
    top_um: FloatProperty(
        name="Top (um)", description="From the scan's upper edge, in micrometres", min=0, **_kept("top_um")
    )
    right_um: FloatProperty(
        name="Right (um)", description="From the scan's left edge, in micrometres", min=0, **_kept("right_um")
    )
    bottom_um: FloatProperty(
        name="Bottom (um)", description="From the scan's upper edge, in micrometres", min=0, **_kept("bottom_um")
    )
    length_nm: FloatProperty(
        name="Length (nm)",
        description="In nanometres: the grating's true period for calibrate, the tip's radius for tip",
        min=0.1, **_kept("length_nm"),
    )  # fmt: skip
    factor: FloatProperty(name="Factor", description="Multiplies all heights", min=1e-3, max=1e3, **_kept("factor"))

    def step(self) -> "Step":
        """The parsed step. Raises GratingError for an invalid text, which a foreign file may hold."""
        from ...precompute.surface.steps.pipeline import steps_of

        (step,) = steps_of([self.text], "Levelling")
        return step

    def _arguments(self) -> list[tuple[Any, float | str]]:
        """The step's arguments with their values; empty if the text is invalid."""
        try:
            step = self.step()
        except GratingError:
            return []
        return list(zip(step.kind.arguments, step.values, strict=True))

    def shown(self) -> list[str]:
        """The names of the properties that show the step's arguments. Raises GratingError as `step` does."""
        return [ARGUMENTS[argument.name] for argument in self.step().kind.arguments]
