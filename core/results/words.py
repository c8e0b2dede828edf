"""The language of pages: texts and numbers as a reader of report and map knows them.

English is written in the code and is the key: `web/de.json` holds English sentences with their
placeholders, each with its German. A text that it lacks stays English. A further language is a
further file of that kind, named by its code, such as `web/fr.json`.

How a text is made translatable, in Python, JavaScript and HTML:

- `say("Of {years} years, half exceed {energy:,.0f} MWh.", years=9, energy=1234.5)` in place of an
  f-string or of `.format`. The sentence is one literal, so that a test finds it; what is between
  braces is a name, and numbers are written as the language does ("1.235 MWh" in German). A value
  that is itself text is said first: `say("{kind} facing {side}", kind=say(kind), side=say(side))`.
- `say_count(3, "{count:,} surface", "{count:,} surfaces")` where a number decides on the word.
- `number(1234.5, ",.1f")` for a number that stands alone, such as a cell of a table.
- In web/*.js: `say("{count} of {all}", { count: format(3, 0), all: format(9, 0) })`, numbers by
  `format`; the page brings its table along as data.
- In web/*.html: `{{A text}}`, in attributes too; `read_html` says it.
- The German: a line in web/de.json with the same names in braces (with `:,.0f` and the like behind
  them, where the English has them). Keys that no code says, or braces that differ, fail
  tests/core/test_words.py.

`speaking` sets the language of all that is said inside it; outside it is English, so that what
runs print and what is tested stays as it is.
"""

import json
import re
import string
import unicodedata
from contextlib import contextmanager
from contextvars import ContextVar
from html import escape
from math import isnan
from pathlib import Path

WEB = Path(__file__).parent / "web"
NUMBER = "1,234.5"  # its line of a table shows how a language writes numbers
_SPOKEN = ContextVar("language and table of what is said", default=("en", {}))


def list_languages():
    """Codes of the languages that there are, English first: list of str."""
    return ["en", *sorted(path.stem for path in WEB.glob("??.json"))]


def read_language(code):
    """Table of a language, English text to its own: dict of str; empty for English."""
    if code == "en":
        return {}
    return json.loads((WEB / f"{code}.json").read_text(encoding="utf-8"))


@contextmanager
def speaking(code):
    """Say all inside in a language of `list_languages`."""
    before = _SPOKEN.set((code, read_language(code)))
    try:
        yield
    finally:
        _SPOKEN.reset(before)


def spoken():
    """Code of the language that is spoken now, and its table: (str, dict)."""
    return _SPOKEN.get()


def say(text, **values):
    """A text in the language that is spoken: str.

    Parameters
    ----------
    text : str
        English, with names in braces, as of `str.format`.
    **values
        For the names; numbers are written as the language does.
    """
    text = _SPOKEN.get()[1].get(text, text)
    return _Writer().vformat(text, (), values) if values else text


def say_weather(label):
    """The label of a run's weather, with the words that stand around names and numbers: str."""
    label = say(label)
    for words, said in (
        ("of the long-term mean", say("of the long-term mean")),
        ("(nearest: ", say("(nearest: ")),
    ):
        label = label.replace(words, said)
    return label


def say_count(count, single, many, **values):
    """One of two texts with `{count}`, by whether it is one."""
    return say(single if count == 1 else many, count=count, **values)


def number(value, form=",.0f"):
    """A number as the language writes it, with a true minus; "–" of None and NaN.

    Parameters
    ----------
    value : float or None
    form : str
        As of `format`: "+,.1f" has a sign, commas between thousands and one decimal.
    """
    if value is None or isnan(value):
        return "–"
    return _Writer().format_field(value, form)


def plain(text):
    """A text as it is searched: small letters without accents, as `plain` of web/viewer.js."""
    letters = [
        sign for sign in unicodedata.normalize("NFD", text) if unicodedata.category(sign)[0] != "M"
    ]
    signs = {"ß": "ss", "æ": "ae", "œ": "oe", "ø": "o", "ł": "l", "đ": "d"}
    return "".join(letters).lower().translate(str.maketrans(signs))


def read_html(name):
    """A file of the folder web whose texts, in double braces, are said: str."""
    html = (WEB / name).read_text(encoding="utf-8")
    return re.sub(
        r"\{\{(.+?)\}\}", lambda match: escape(say(" ".join(match[1].split()))), html, flags=re.S
    )


def words_as_data():
    """The table of the language that is spoken, as an element that web/viewer.js reads: str."""
    table = json.dumps(_SPOKEN.get()[1], ensure_ascii=False, separators=(",", ":"))
    table = table.replace("<", "\\u003c")  # no text ends the element
    return f'<script type="application/json" id="words">{table}</script>'


class _Writer(string.Formatter):
    """Formats numbers with the signs of the language that is spoken."""

    def format_field(self, value, form):
        written = super().format_field(value, form)
        if isinstance(value, str):
            return written
        signs = _SPOKEN.get()[1].get(NUMBER, NUMBER)
        written = written.translate(str.maketrans(",.-", f"{signs[1]}{signs[-2]}−"))
        # What is rounded to zero has no sign.
        return written if any(digit in written for digit in "123456789") else written.lstrip("−")
