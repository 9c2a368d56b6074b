# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators. Each calls a function of addon/workflow/, imported when the button is pressed. Command-line verbs read
their options from the properties of these classes (addon/batch/)."""
