# SPDX-License-Identifier: GPL-3.0-or-later
"""One operator a file. An operator calls an action, which it loads when its button is pressed."""
