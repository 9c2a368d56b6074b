# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception that a user is meant to read."""


class GratingError(Exception):
    """A failure that its reader can mend: one line, "WHAT: fault; remedy"."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))
