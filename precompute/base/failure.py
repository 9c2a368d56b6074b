# SPDX-License-Identifier: GPL-3.0-or-later
"""The one exception whose text is meant for the user."""


class GratingError(Exception):
    """A failure that the user can do something about. Its text is one line: "WHAT: fault; remedy"."""

    def __init__(self, message: str) -> None:
        super().__init__(" ".join(message.split()))
