# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line `blender --background [FILE] --command grating VERB ...`. A verb's module is imported when it is
called."""
