# SPDX-License-Identifier: GPL-3.0-or-later
"""Optics that do not depend on the relief: Fresnel reflectance, obliquity, coherence, regions of (u, v)."""
