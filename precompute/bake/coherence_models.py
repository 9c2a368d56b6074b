# SPDX-License-Identifier: GPL-3.0-or-later
"""The coherence models of a bake. Each is a module with the functions of CoherenceModel."""

from collections.abc import Sequence
from typing import Protocol

from ..base.progress import Progress
from ..surface.relief import Relief
from ..table.sample_set import SampleSet
from ..table.table import Table
from . import ensemble, patch
from .plan import Plan
from .request import BakeRequest
from .self_check import Judge


class CoherenceModel(Protocol):
    """A coherence model: plans the resolution of a bake, makes the bake, and measures its error."""

    def plan(self, reliefs: Sequence[Relief], request: BakeRequest, *, progress: Progress = ...) -> Plan:
        """Choose the resolution that a table needs to keep the request's colour error.

        Raises GratingError for a request that the model cannot keep."""
        ...

    def carry_out(self, chosen: Plan, illuminant: str, progress: Progress) -> Table:
        """Make the table of a plan, without wider blur levels."""
        ...

    def judge(self, reliefs: Sequence[Relief], chosen: Plan, illuminant: str, *, progress: Progress) -> Judge:
        """What a plan's table is judged by: the reliefs' exact spectra."""
        ...

    def sample_set(self, chosen: Plan) -> SampleSet | None:
        """Make the sample set that belongs to the table, for lights of every kind; None if the model has none."""
        ...


# The models by their names in a request (MODELS in request.py).
COHERENCE_MODELS: dict[str, CoherenceModel] = {"ensemble": ensemble, "patch": patch}
