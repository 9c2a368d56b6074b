# SPDX-License-Identifier: GPL-3.0-or-later
"""The laboratory's verbs of the command line `./dev grating VERB`: one file for each verb."""

from precompute.cli import parser

# The help text of each verb.
VERBS = {
    "evaluate": "the grating period that follows from each method's colours",
    "efficiency": "a grating's efficiencies against their closed forms",
    "benchmark": "speed against error: every method on the same surfaces",
}
# The product's verbs and those of the laboratory.
PACKAGES = parser.PACKAGES | {__package__: VERBS}
