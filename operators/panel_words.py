"""Errors in the words of the panel: a setting has a title there, and an option on the command line."""

import re

from ..core.request import declared_settings, option_of


def in_panel_words(text):
    """Text in which options of the command line are the titles of the panel, where it has them.

    Parameters
    ----------
    text : str

    Returns
    -------
    str
    """
    titles = {option_of(name): details.title for name, _, details in declared_settings() if details.title}
    return re.sub(r"--[a-z][a-z-]*", lambda found: titles.get(found[0], found[0]), str(text))
