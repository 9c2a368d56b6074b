# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake judged from its files alone. Of the other rooms it shares the surface, the observer and the error metrics."""
