# SPDX-License-Identifier: GPL-3.0-or-later
"""Studies and benchmarks of the product. The extension does not ship them, and nothing that ships imports them."""
