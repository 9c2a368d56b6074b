# SPDX-License-Identifier: GPL-3.0-or-later
"""What every other package uses: the error that a user reads, writing whole files, strict JSON, OpenEXR, progress."""
