"""Every panel draws at every state of a city: each property, operator and icon that it names
exists.
"""

import textwrap
from inspect import getattr_static, isfunction
from types import MethodType, SimpleNamespace

import blf
import bpy
import pytest
from steps import here, run

from citypv.citypv_addon import CLASSES
from citypv.citypv_addon.menus import CityMenu, draw_city_menu
from citypv.operators.run.compare_results import write_row
from citypv.operators.show.draw_view import LETTERS_OF_NOTE, describe_amount

PANELS = [item for item in CLASSES if hasattr(item, "bl_category")]  # of the sidebar
ICONS = set(bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys())


class Layout:
    """Stands for Blender's layout: checks what is drawn, and keeps the texts."""

    def __init__(self, texts):
        self.texts = texts

    def column(self, **_):
        return Layout(self.texts)

    row = box = split = grid_flow = column

    def panel(self, name, default_closed=False):
        return Layout(self.texts), Layout(self.texts)

    def prop(self, data, name, expand=False, **_):
        assert name in data.bl_rna.properties, name

    def label(self, text="", icon="NONE"):
        assert icon in ICONS, icon
        self.texts.append(text)

    def progress(self, factor, text):
        assert 0 <= factor <= 1
        self.texts.append(text)

    def operator(self, name, text="", icon="NONE", depress=False):
        assert icon in ICONS, icon
        room, _, own = name.partition(".")
        kind = getattr(getattr(bpy.ops, room), own).get_rna_type()
        return SimpleNamespace(bl_rna=SimpleNamespace(name=kind.name))

    def separator(self):
        self.texts.append("")

    def menu(self, name):
        assert hasattr(bpy.types, name), name

    def operator_menu_enum(self, name, prop, icon="NONE"):
        assert prop in getattr(bpy.ops.citypv, name.partition(".")[2]).get_rna_type().properties
        self.operator(name, icon=icon)


class Stand:
    """Stands for a panel, which Blender alone can make, on a layout."""

    def __init__(self, panel, layout):
        self.panel, self.layout = panel, layout

    def __getattr__(self, name):
        own = getattr_static(self.panel, name)
        return MethodType(own, self) if isfunction(own) else getattr(self.panel, name)


def draw_all():
    """Texts of all panels of the sidebar."""
    texts = []
    for panel in PANELS:
        stand = Stand(panel, Layout(texts))
        stand.draw(bpy.context)
        if hasattr(panel, "draw_header_preset"):
            stand.draw_header_preset(bpy.context)
    menu = SimpleNamespace(layout=Layout(texts))
    CityMenu.draw(menu, bpy.context)
    draw_city_menu(menu, bpy.context)
    return texts


@pytest.mark.slow
def test_results_stand_first_once_there_are_some(addon, city_file):
    def seen():
        shown = [
            panel for panel in PANELS[1:] if not hasattr(panel, "poll") or panel.poll(bpy.context)
        ]
        return [panel.bl_label for panel in sorted(shown, key=lambda panel: panel.bl_order)]

    steps = ["1  Import", "2  Classify", "3  Trace", "4  Energy", "5  Colour"]
    run("import_city", "classify", city_path=str(city_file))
    assert seen() == steps
    run("trace", samples=16, shadow_samples=2, days=1)
    assert seen() == ["What if", "Results", "Probe", "Timeline", *steps]
    run("classify")
    assert seen() == steps
    # they stay while an edit is computed
    here()["citypv_preview"] = "an estimate; exact numbers follow"
    assert seen() == ["What if", "Results", "Probe", "Timeline", *steps]
    draw_all()


@pytest.mark.slow
def test_panels_draw_at_every_step(addon, city_file, row_file):
    assert "Choose a city, or drop its file here" in draw_all()
    for step in ("import_city", "classify", "trace", "energy"):
        run(step, city_path=str(city_file), samples=16, shadow_samples=2, days=1)
        assert "done" in draw_all()
    texts = draw_all()
    city = here()
    assert next(row.split("|")[1] for row in city["citypv_totals"]) in texts
    addon.attribute, addon.auto_range = "kind", False
    addon.low, addon.high = 2, 1
    assert "Low must be below High" in draw_all()
    run("keep_before", "energy")
    assert {"Existing", "All"} <= set(draw_all())
    run("import_city", city_path=str(row_file))
    assert {"Not computed yet: run the steps", "   above"} <= set(draw_all())  # in lines that fit


@pytest.mark.parametrize(
    ("state", "before", "after", "percent"),
    [
        ("existing", 14.0, 0.0, "−100.0 %"),
        ("existing", 40.0, 50.0, "+25.0 %"),
        ("gone", 14.0, 0.0, "gone"),
        ("new", 0.0, 9.0, "new"),
    ],
)
def test_a_row_of_the_comparison_tells_percent_or_why_there_is_none(state, before, after, percent):
    row = {
        "name": "house",
        "state": state,
        "before": before,
        "after": after,
        "change": after - before,
        "error": 0.1,
    }
    assert write_row(row)[4] == percent


def test_texts_over_the_view_fit_and_have_plain_numbers():
    blf.size(0, 11)
    note = (
        "First look, by 16 rays, 4 shadow points and 4 days. Trace light computes it as set in its "
        "step; a year"
    )
    assert (
        400
        < max(blf.dimensions(0, line)[0] for line in textwrap.wrap(note, LETTERS_OF_NOTE))
        <= 500
    )
    told = [
        describe_amount(power, "kW", "W") for power in (1234.5, 250.0, 31.4, 6.82, 0.9996, 0.0023)
    ]
    assert told == ["1,234 kW", "250 kW", "31 kW", "6.8 kW", "1,000 W", "2.3 W"]
