# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps by which a scan is levelled and repaired before it is baked, a few to a file, and the pipeline of them."""
