# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages of docs/: their site, their checks, and the texts of the add-on that they quote."""
