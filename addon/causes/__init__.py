# SPDX-License-Identifier: GPL-3.0-or-later
"""Why an artist sees no diffraction colours: checks of one scene and one grating. None of them changes anything."""
