# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line `blender --background [FILE] --command grating VERB ...`. Each verb is a module, imported when the
verb is called."""
