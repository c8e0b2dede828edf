"""Steps with files in a Blender window: one by one, all at once, dropped by mouse, undone."""

import gzip
import shutil
from pathlib import Path

from drop_file import drop_file
from window_steps import PREPARE, RUNNING, keep_picture, press, read_reports

EXAMPLE = Path(__file__).parents[2] / "examples/berlin"
CITY = "bpy.data.objects['City']"
SHADING = PREPARE + "s = area.spaces.active.shading; answer = [s.light, s.color_type]"
IN_VIEW = 400, 400  # a place in the 3D view [pixels]
HAS_KIND = f"'citypv_kind' in {CITY}.data.attributes"

# Notes what the view shows, each time that it is something else.
NOTE = """
space = bpy.app.driver_namespace
space["shown"] = []
def note():
    city = next((one for one in bpy.data.objects if one.get("citypv_part") == "city" and one.visible_get()), None)
    now = None if city is None else [city.get("citypv_colour_attribute"), city.get("citypv_interrupted", "")[:10]]
    if now != (space["shown"] or [None])[-1]:
        space["shown"].append(now)
    return 0.02 if space["noting"] else None
space["noting"] = True
bpy.app.timers.register(note)
"""


def press_step(window, operator, evidence):
    """Press the button of a step that was not run yet, and wait for what it leaves."""
    assert not window.ask(f"answer = {evidence}")
    press(window, operator)
    window.wait_for(evidence, 300)  # the loops are compiled first
    window.wait_for(f"{RUNNING} is None")
    window.take_picture(window.pictures / f"{operator}.png")
    assert "Traceback" not in window.read_log()


def undo_to_import(window):
    """Undo the classification: the shape is seen in a studio light, not as a white silhouette; then redo it."""
    assert window.ask(SHADING) == ["FLAT", "VERTEX"]
    window.point("mousemove", *IN_VIEW, "key", "ctrl+z")
    window.wait_for(f"not {HAS_KIND}")
    assert window.ask(SHADING) == ["STUDIO", "MATERIAL"]
    keep_picture(window, "undone")
    window.point("mousemove", *IN_VIEW, "key", "ctrl+shift+z")
    window.wait_for(HAS_KIND)
    assert window.ask(SHADING) == ["FLAT", "VERTEX"]
    assert "Traceback" not in window.read_log()


def three_clicks(window, path):
    """Run *Solar city* as it comes: buildings, kinds, first look and result are seen one after the other."""
    window.ask(
        f"s = bpy.context.scene.citypv; s.city_path = {path!r}\n"
        "s.suns, s.days, s.samples, s.shadow_samples = 'days', 24, 256, 16"
    )
    window.ask(NOTE)
    press(window, "citypv.solar_city")
    window.wait_for(f"{RUNNING} is not None", 20)
    window.wait_for(f"{RUNNING} is None", 600)
    keep_picture(window, "solar-city")
    shown = window.ask("s = bpy.app.driver_namespace; s['noting'] = False; answer = s['shown']")
    assert shown[-4:] == [[None, ""], ["kind", ""], ["full_load_hours", "First look"], ["full_load_hours", ""]]
    assert window.ask(f"answer = 'citypv_totals' in {CITY}")
    assert "Traceback" not in window.read_log()


def drop_weather(window, exchange):
    """Drop weather files on the view: of another place it is refused, else the energy is computed anew with it."""
    packed = Path(__file__).parents[1] / "data/weather/CHL_Santiago_TMYx.epw.gz"
    (exchange / "santiago.epw").write_bytes(gzip.decompress(packed.read_bytes()))
    before = window.ask(f"answer = {CITY}['citypv_weather']")
    assert drop_file(window.display, f"/{exchange.name}/santiago.epw", *IN_VIEW)
    window.wait_for("bpy.context.scene.citypv.weather_file.endswith('santiago.epw')")
    window.wait_for(f"{RUNNING} is None")
    assert "km from the latitude 52." in read_reports(window).splitlines()[-1]
    assert window.ask(f"answer = {CITY}['citypv_weather']") == before
    window.point("mousemove", *IN_VIEW, "key", "Escape")  # closes the message, which takes all keys
    window.ask("bpy.context.scene.citypv.allow_distance = 20000")
    assert drop_file(window.display, f"/{exchange.name}/santiago.epw", *IN_VIEW)
    window.wait_for(f"'santiago.epw' in {CITY}['citypv_weather']")
    window.wait_for(f"{RUNNING} is None")
    assert "km" in window.ask(f"answer = {CITY}['citypv_weather_place']")
    window.ask("bpy.context.scene.citypv.allow_distance = 150")
    shutil.copy(EXAMPLE / "era5_berlin_2017.nc", exchange / "weather.nc")
    assert "ERA5" not in window.ask(f"answer = {CITY}['citypv_weather']")
    assert drop_file(window.display, f"/{exchange.name}/weather.nc", *IN_VIEW)
    window.wait_for(f"'ERA5' in {CITY}['citypv_weather']")
    window.wait_for(f"{RUNNING} is None")
    assert window.ask("s = bpy.context.scene.citypv; answer = s.weather, s.weather_file") == [
        "file",
        f"/{exchange.name}/weather.nc",
    ]
    assert "Traceback" not in window.read_log()


def drop_city(window, path, exchange):
    """Drop another city: it stands beside the first one, which is hidden; undo brings that back."""
    shutil.copy(path, exchange / "row.gml")
    window.ask(
        "s = bpy.context.scene.citypv; s.weather = 'climate'\n"
        "s.suns, s.typical_days, s.samples, s.shadow_samples = 'typical-days', 1, 64, 4"
    )
    assert drop_file(window.display, f"/{exchange.name}/row.gml", *IN_VIEW)
    cities = "[o for o in bpy.data.objects if o.get('citypv_part') == 'city' and 'citypv_totals' in o]"
    window.wait_for(f"len({cities}) == 2", 600)
    assert window.ask(f"answer = sum(o.visible_get() for o in {cities})") == 1
    keep_picture(window, "two-cities")
    window.point("mousemove", *IN_VIEW, "key", "ctrl+z")
    window.wait_for(f"len({cities}) == 1 and {CITY}.visible_get()")
    assert "Traceback" not in window.read_log()
