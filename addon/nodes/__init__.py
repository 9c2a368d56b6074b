# SPDX-License-Identifier: GPL-3.0-or-later
"""A builder by which the code of a node tree reads like its formula."""
