# SPDX-License-Identifier: GPL-3.0-or-later
"""The models of coherence under which a bake can be made. Each is a module with the functions of CoherenceModel."""

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
    """What a model of coherence knows: how fine a bake of reliefs must be, how to make it, and how to judge it."""

    def plan(self, reliefs: Sequence[Relief], request: BakeRequest, *, progress: Progress = ...) -> Plan:
        """How fine a table must be to keep the request's colour error.

        Raises GratingError for a request that the model cannot keep."""
        ...

    def carry_out(self, chosen: Plan, illuminant: str, progress: Progress) -> Table:
        """The table that a plan describes, without wider levels."""
        ...

    def judge(self, reliefs: Sequence[Relief], chosen: Plan, illuminant: str, *, progress: Progress) -> Judge:
        """What tells the error of a table of a plan in both forms, against the reliefs' exact spectra."""
        ...

    def sample_set(self, chosen: Plan) -> SampleSet | None:
        """The sample set that stands beside the table, for lights of every kind; None if the model has none."""
        ...


# The models by the names that a request gives them (MODELS in request.py).
COHERENCE_MODELS: dict[str, CoherenceModel] = {"ensemble": ensemble, "patch": patch}
