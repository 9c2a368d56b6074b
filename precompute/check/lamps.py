# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a bake's colours under lamps of other spectra, whose errors its header states."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..base.failure import GratingError
from ..colour.channels import lamp_matrix
from ..colour.illuminants import FIRST, JOINT, first_of, is_illuminant
from ..measure.errors import Errors, Truth, measure
from .table_file import Table

# The greatest number of lamps in a header; a bake states eight.
_MOST = 32


@dataclass(frozen=True)
class Lamp:
    """The errors of a bake's colours under a lamp, and the dE00 that their 95th percentile keeps by the bake's header:
    at other directions, and however the values of w are distributed."""

    errors: Errors
    claimed: float

    @property
    def keeps_claim(self) -> bool:
        """Whether the measured percentile keeps the claim, up to its sampling error."""
        return self.errors.p95 <= self.claimed + self.errors.p95_allowance

    def as_dict(self) -> dict[str, Any]:
        """Convert to JSON; null stands for an infinite error."""
        told = self.errors.as_dict()
        figures = {name: told[name] for name in ("mean", "p95", "pairs")}
        return {**figures, "p95_allowance": self.errors.p95_allowance, "p95_claimed": self.claimed}


def fault_of(lamps: Mapping[str, Lamp]) -> str:
    """A sentence on the lamp that exceeds its claim most; "" if none does."""
    wrong = {lamp: its for lamp, its in lamps.items() if not its.keeps_claim}
    if not wrong:
        return ""
    lamp, its = max(wrong.items(), key=lambda each: each[1].errors.p95 - each[1].claimed)
    return f"dE00 p95 {its.errors.p95:.2f} under {lamp:.40}, claimed {its.claimed:.2f}"


def claims(table: Table, bake: Path) -> dict[str, float]:
    """The dE00 that the 95th percentile keeps under each lamp by a bake's header.

    Raises GratingError for a header that no bake has."""
    delta_e = table.record.get("delta_e")
    told = delta_e.get("lamps_claim", {}) if isinstance(delta_e, dict) else {}
    if not (
        isinstance(told, dict)
        and len(told) <= _MOST
        and (first_of(table.illuminant) == FIRST or not told)
        and all(JOINT not in lamp and is_illuminant(lamp) for lamp in told)
        and all(type(claim) in (int, float) and claim >= 0 for claim in told.values())
    ):
        raise GratingError(bake, "its header's lamps_claim cannot be", "bake it again")
    return {lamp: float(claim) for lamp, claim in told.items()}


def of_lamps(table: Table, truths: Mapping[str, Sequence[Truth]], claimed: Mapping[str, float]) -> dict[str, Lamp]:
    """The errors of a table's colours under each lamp, by the lamps' truths on the same pairs.

    Daylight is white, so that a lamp's own colour counts. The exposure is the one with the largest 95th percentile."""
    pairs = next(iter(truths.values()), ())
    held = [(table.channels_over_w2(t.pairs.u, t.pairs.v, t.w), table.zero_order_channels(t.w)) for t in pairs]

    def errors(lamp: str) -> Errors:
        matrix, own = lamp_matrix(table.illuminant, lamp).T, list(truths[lamp])
        under = {t.w: (light @ matrix, mirrored @ matrix) for t, (light, mirrored) in zip(own, held, strict=True)}
        return measure(own, lambda u, v, w: under[w], ratio_ior=table.ratio_ior, worst_by="p95")

    return {lamp: Lamp(errors(lamp), claimed[lamp]) for lamp in truths}
