"""Pages in other languages: tables that fit the code, numbers as a reader writes them."""

import ast
import json
import string
from pathlib import Path

import pytest

from citypv.core.results import words

CORE = Path(words.__file__).parents[1]


def said_in_code():
    """Every text that Python, JavaScript or HTML of core holds: set of str, and the last two whole."""
    trees = [ast.parse(path.read_text("utf-8")) for path in CORE.rglob("*.py")]
    texts = {
        node.value for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Constant)
    }
    names = [*words.WEB.glob("[!t]*.js"), *words.WEB.glob("*.html")]  # without three.js and tiles
    return texts, " ".join(" ".join(path.read_text("utf-8").split()) for path in names)


def fields(text):
    return sorted((name, form) for _, name, form, _ in string.Formatter().parse(text) if name)


@pytest.mark.parametrize("code", words.list_languages()[1:])
def test_a_table_has_texts_of_the_code_with_the_same_names(code):
    texts, web = said_in_code()
    table = words.read_language(code)
    for english, own in table.items():
        assert english in texts or english in web, f"nothing says {english!r}"
        assert fields(english) == fields(own), own
    lines = (words.WEB / f"{code}.json").read_text("utf-8").splitlines()
    keys = [line.split('": "')[0] for line in lines if '": "' in line]
    assert len(keys) == len(set(keys)) == len(table)


def test_numbers_are_written_as_the_language_does(monkeypatch):
    table = {words.NUMBER: "1.234,5", "{energy:,.1f} MWh on {name}": "{energy:,.1f} MWh auf {name}"}
    monkeypatch.setattr(words, "read_language", {"en": {}, "de": table}.get)
    text, values = "{energy:,.1f} MWh on {name}", {"energy": -1234567.89, "name": "1,000.5"}
    assert words.say(text, **values) == "−1,234,567.9 MWh on 1,000.5"
    with words.speaking("de"):
        assert words.say(text, **values) == "−1.234.567,9 MWh auf 1,000.5"
        assert words.number(1e6) == "1.000.000" and words.number(-0.04, ",.1f") == "0,0"
        assert words.say("not in the table") == "not in the table"
        assert words.number(float("nan")) == words.number(None) == "–"
        with words.speaking("en"):
            assert words.number(0.5, "+.1f") == "+0.5"
    assert words.spoken() == ("en", {})


def test_the_weather_of_a_page_is_told_in_its_language():
    label = "ERA5 nearest.nc (nearest: 52.6°, 13.35°), 97 % of the long-term mean"
    german = "ERA5 nearest.nc (nächster Punkt: 52.6°, 13.35°), 97 % des langjährigen Mittels"
    assert words.say_weather(label) == label
    with words.speaking("de"):
        assert words.say_weather(label) == german
        assert words.say_weather("my weather.csv") == "my weather.csv"


def test_the_table_as_data_ends_no_element(monkeypatch):
    monkeypatch.setattr(words, "read_language", {"xx": {"a": "</script><b>"}}.get)
    with words.speaking("xx"):
        element = words.words_as_data()
    assert element.count("<") == 2
    assert json.loads(element.partition(">")[2].partition("</script>")[0]) == {"a": "</script><b>"}
