"""Find a module or an inverter in pvlib's libraries by its name or a part of it."""

import difflib
from functools import cache, lru_cache

import pvlib

from ..settings.errors import InputError

SHOWN = 5  # names that an error lists
CANDIDATES = 400  # names that are compared letter by letter


@lru_cache
def read_library(library):
    """One of pvlib's tables: pandas.DataFrame, a column for each product."""
    return pvlib.pvsystem.retrieve_sam(library)


def search_library(text, libraries, *, option):
    """Find the one product that a name, or a part of it, matches.

    Case, spaces and punctuation are ignored. A full name takes precedence over a part of one, and a part over words in
    another order.

    Parameters
    ----------
    text : str
    libraries : sequence of str
        Names for `pvlib.pvsystem.retrieve_sam`; the first one with an exact match is used.
    option : str
        Command line option, for the error.

    Returns
    -------
    library, name : str

    Raises
    ------
    InputError
        If no name matches (lists the nearest), or several do (lists some of them).
    """
    for library in libraries:
        if text in read_library(library):
            return library, text
    known = list(dict.fromkeys((library, name) for library in libraries for name in read_library(library)))
    wanted, words = join_letters(text), split_words(text)
    fits = [
        lambda name: join_letters(name) == wanted,
        lambda name: wanted in join_letters(name),
        lambda name: all(word in join_letters(name) for word in words),
    ]
    for fit in fits if wanted else ():
        found = [(library, name) for library, name in known if fit(name)]
        if len({name for _, name in found}) == 1:
            return found[0]
        if found:
            names = ", ".join(name for _, name in found[:SHOWN])
            more = f" and {len(found) - SHOWN:,} more" if len(found) > SHOWN else ""
            raise InputError(option, f"{text!r} matches {len(found):,} names", f"give more of the name: {names}{more}")
    nearest = list_nearest(text, [name for _, name in known])
    raise InputError(
        option,
        f"{text!r} is not in pvlib's libraries ({', '.join(libraries)})",
        f"give one of its names, nearest: {nearest}",
    )


def list_nearest(text, names):
    """The names most similar to a text, joined by commas: those with most of its words, then by similarity."""
    words = split_words(text)
    shared = {name: sum(word in join_letters(name) for word in words) for name in names}
    candidates = sorted(names, key=lambda name: -shared[name])[:CANDIDATES]
    wanted = join_letters(text)
    matcher = difflib.SequenceMatcher(b=wanted, autojunk=False)

    def likeness(name):
        matcher.set_seq1(join_letters(name))
        return shared[name], matcher.ratio()

    return ", ".join(sorted(candidates, key=likeness, reverse=True)[:SHOWN])


@cache
def join_letters(name):
    """Letters and digits of a name, in lower case."""
    return "".join(letter for letter in name.lower() if letter.isalnum())


def split_words(text):
    """Words of letters and digits, in lower case."""
    return "".join(letter if letter.isalnum() else " " for letter in text.lower()).split()
