# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages in an artist's words, and in the language of Blender's interface."""

from pathlib import Path

from bpy.app.translations import pgettext_iface

from ...precompute.base.failure import GratingError, Setting, Words, printable, spelled
from .cache_folder import cache_folder

# The names of the settings in the panel and in the dialogs. What only the command line has is named as it is there.
LABELS = {
    Setting.SIZE_UM: "Width (um) in the import dialog",
    Setting.HEIGHT_NM: "Height (nm) in the import dialog",
    Setting.CHANNEL: "Channel in the import dialog",
    Setting.LEVEL: "Levelling",
    Setting.DELTA_E: "Colour Error",
    Setting.COHERENCE_UM: "Coherence",
    Setting.SPREAD_DEG: "Direction Spread",
    Setting.METHOD: "Method",
    Setting.MATTER: "Matter",
    Setting.NEEDS: "Bake for This Scene",
    **{
        setting: f"the command line's {setting.value}"
        for setting in (Setting.MODEL, Setting.PATCH_UM, Setting.TERMS, Setting.PERIOD_NM)
    },
}


def translated(text: str, /, **values: object) -> str:
    """A text in the language of Blender's interface. It names its values in braces, and a translation may order them
    otherwise. `python -m devtools.docs.user_texts` lists the texts for translators."""
    found: str = pgettext_iface(text)  # type: ignore[func-returns-value, assignment]  # the stubs say it returns None
    if not values:
        return found
    try:
        return found.format(**values)
    except (LookupError, ValueError, AttributeError):  # a faulty translation
        return text.format(**values)


def marked(text: str) -> str:
    """The text itself, which is translated where it is shown. The list for translators finds it by this call."""
    return text


def counted(one: str, several: str, count: int, /, **values: object) -> str:
    """A translated text for one thing, or for several, which names their number as {count}."""
    return translated(one if count == 1 else several, count=count, **values)


def in_words(message: GratingError | str) -> str:
    """A message as one printable line for an artist, translated as far as its texts are fixed: settings have the names
    of the interface, and a file in the cache, whose path takes more than 100 letters, has its name for its path."""
    if isinstance(message, str):
        return printable(translated(message))
    path, remedy = Path(message.what), message.remedy
    remedy = translated(remedy) if isinstance(remedy, str) else remedy
    what = None
    if path.is_relative_to(cache_folder()):
        # The cache's folders are named by hashes.
        what = translated("{name} in the cache", name=path.name) if path.suffix else translated("the cache")
    return GratingError(message.what, translated(message.fault), remedy).line(what, LABELS.__getitem__)


def labelled(words: Words) -> str:
    """A text with the interface's names of the settings in it."""
    return spelled(words, LABELS.__getitem__)


def in_one_line(facts: str) -> str:
    """A summary, which has a fact on each line, as one line."""
    return ", ".join(facts.splitlines())
