# SPDX-License-Identifier: GPL-3.0-or-later
"""Scripts that model the sample snake and the stage on which it is rendered."""
