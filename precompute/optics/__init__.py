# SPDX-License-Identifier: GPL-3.0-or-later
"""The optics that do not depend on a relief: Fresnel reflectance, Stam's obliquity, coherence."""
