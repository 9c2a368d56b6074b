# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender --background [FILE] --command grating VERB ...`: a verb a file, loaded when it is called."""
