# SPDX-License-Identifier: GPL-3.0-or-later
"""The models of coherence that a bake can be made under: one module each, of one shape."""

from collections.abc import Sequence
from typing import Protocol

from ..base.progress import Progress
from ..measure.errors import Errors
from ..surface.relief import Relief
from ..table.sample_set import SampleSet
from ..table.table import Table
from . import ensemble, patch
from .plan import Plan
from .request import BakeRequest


class CoherenceModel(Protocol):
    """What a model of coherence knows: how fine a bake of reliefs must be, how to make it, how to judge it."""

    def plan(
        self, reliefs: Sequence[Relief], request: BakeRequest, *, progress: Progress = ..., finer: float = ...
    ) -> Plan:
        """How the request is to be kept, with `finer` times as many texels as the probe finds needed. Raises
        GratingError for a request that the model cannot keep."""
        ...

    def carry_out(self, chosen: Plan, illuminant: str, progress: Progress) -> Table:
        """The table that a plan describes."""
        ...

    def self_check(self, reliefs: Sequence[Relief], chosen: Plan, stored: Table, progress: Progress) -> Errors:
        """The error of a table, as its file will hold it, against the exact spectra of the reliefs."""
        ...

    def sample_set(self, chosen: Plan) -> SampleSet | None:
        """What stands beside the table for lights of every kind; None where the model has none."""
        ...


# By the names that a request gives them (request.py).
COHERENCE_MODELS: dict[str, CoherenceModel] = {"ensemble": ensemble, "patch": patch}
