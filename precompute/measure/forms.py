# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors of a bake in both forms of the BRDF (docs/theory.md, "BRDF")."""

from dataclasses import dataclass
from typing import Any

from .errors import Errors

# The allowed error |dY| / Y of a form, for a requested dE00 of 1 or less; for more, it grows in proportion.
RELATIVE_DY = 0.01
# The greatest dE00 per relative error of the bound, at Y = 1: the derivative 116 / 3 of L* over CIEDE2000's weight.
DELTA_E_OF_BOUND = 116 / 3 / 1.75
# The forms' names in sentences.
FORM_NAMES = {"conserving": "the energy-conserving form", "stam": "Stam's form"}


@dataclass(frozen=True)
class FormErrors:
    """Errors of Stam's form and of the energy-conserving form, the materials' default; None without an albedo bound."""

    stam: Errors
    conserving: Errors | None

    @property
    def forms(self) -> dict[str, Errors]:
        """The errors by the form's name, the default form first."""
        found = {"conserving": self.conserving, "stam": self.stam}
        return {name: errors for name, errors in found.items() if errors is not None}

    @property
    def shown(self) -> Errors:
        """The errors of the materials' default form."""
        return self.stam if self.conserving is None else self.conserving

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """Convert the errors to JSON: the default form's, and each form's by its name."""
        by_form = {name: errors.as_dict() for name, errors in self.forms.items()}
        return {"delta_e": self.shown.as_dict(), "delta_e_by_form": by_form}
