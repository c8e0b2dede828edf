"""A library that is missing or does not load: the add-on enables, and says what failed and what to
do.
"""

import sys

import pytest
from steps import forget_module, refuse
from test_panels_draw import draw_all

import citypv
from citypv.operators.city import check_libraries

AGAIN = ("lxml.", "citypv.core.read", "citypv.core.run.study")  # modules that a step imports anew
ENDINGS = {
    (3, 11): "blender_4.5.zip",
    (3, 13): "blender_5.2.zip",
    (3, 14): "blender_5.2_python_3.14.zip",
}


def said():
    """What the panels say of libraries, as one line."""
    texts = [text.strip() for text in draw_all()]
    return " ".join(texts[: texts.index("Choose a city, or drop its file here")])


def test_nothing_is_said_where_all_is_well(addon):
    assert check_libraries.FAILURES == []
    assert said() == ""


def test_a_missing_library_is_named_as_soon_as_the_add_on_is_enabled(monkeypatch):
    found = check_libraries.importlib.util.find_spec
    hidden = lambda name: None if name in ("embreex", "numba") else found(name)  # noqa: E731
    monkeypatch.setattr(check_libraries.importlib.util, "find_spec", hidden)
    citypv.register()
    try:
        words = said()
    finally:
        citypv.unregister()
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    assert f"Missing for Python {version}: embreex, numba." in words
    closed = words.replace(" ", "")
    assert "installcitypv-" in closed and ENDINGS[sys.version_info[:2]] in closed


@pytest.mark.parametrize(("error", "word"), [
    (ImportError("libembree4.so.4: cannot open shared object file"), "libembree4.so.4"),
    (OSError("Could not find/load shared object file 'libllvmlite.so'"), "libllvmlite.so"),
])  # fmt: skip
def test_a_library_that_does_not_load_is_named_by_the_step_and_in_the_panel(
    addon, city_file, monkeypatch, error, word
):
    class Broken:
        def find_spec(self, name, *_):
            if name == "lxml" or name.startswith("lxml."):
                raise error

    for name in [name for name in sys.modules if name == "lxml" or name.startswith(AGAIN)]:
        forget_module(monkeypatch, name)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    addon.city_path = str(city_file)
    refuse("import_city", rf"A library could not be loaded: .*{word}")
    assert word in said().replace(" ", "") and "installcitypv-" in said().replace(" ", "")
    monkeypatch.undo()
    check_libraries.check_libraries()
    assert said() == ""
