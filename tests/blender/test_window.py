"""The steps by mouse in a real Blender window (see tools/blender_window.py)."""

import importlib.util
import os
import shutil
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from window_edits import move_tower, undo_move
from window_files import press_step, repeat_steps, three_clicks, undo_to_import
from window_steps import PREPARE, RUNNING, find_on_screen, keep_picture, press, read_reports
from window_stops import edit_at_moments, replace, undo, undo_first_city, wait_until_settled

from citypv.operators.city.attributes import CODES

ROOT = os.environ.get("CITYPV_BLENDER")
REPOSITORY = Path(__file__).parents[2]
NAME = "street.gml"

pytestmark = [
    pytest.mark.window,
    pytest.mark.slow,
    pytest.mark.skipif(
        not ROOT, reason="CITYPV_BLENDER names no Blender root; tools/blender_window.py builds one"
    ),
]


# The panels of the steps are closed in a new window: these tests press their buttons.
OPEN_PANELS = """
addon = __import__("importlib").import_module("bl_ext.user_default.citypv.citypv_addon")
panels = [item for item in addon.CLASSES if hasattr(item, "bl_category")]
for panel in [*reversed(panels)]:
    bpy.utils.unregister_class(panel)
for panel in panels:
    panel.bl_options = set()
    bpy.utils.register_class(panel)
"""


def load_tool():
    path = REPOSITORY / "tools/blender_window.py"
    spec = importlib.util.spec_from_file_location("blender_window", path)
    tool = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = tool
    spec.loader.exec_module(tool)
    return tool


@pytest.fixture(scope="module")
def window(city_file, tmp_path_factory):
    """A window with the tab CityPV open; a picture of its end is kept beside the other temporary
    files.
    """
    tool, root = load_tool(), Path(ROOT)
    assert "Installed" in tool.install_extension(root)
    shutil.copy(city_file, root / tool.EXCHANGE / NAME)
    pictures = Path(os.environ.get("CITYPV_PICTURES") or tmp_path_factory.mktemp("window"))
    with tool.Window(root) as opened:
        opened.pictures, opened.places = pictures, {}
        opened.ask(PREPARE + "area.spaces.active.show_region_ui = True")
        opened.wait_for(
            "any(r.type == 'UI' and r.width > 100 for a in bpy.data.screens['Layout'].areas for r "
            "in a.regions)"
        )
        opened.ask(
            f"s = bpy.context.scene.citypv; s.city_path = '/{tool.EXCHANGE}/{NAME}'\n"
            "s.typical_days, s.samples, s.shadow_samples = 2, 64, 4"
        )
        opened.ask(OPEN_PANELS)
        time.sleep(1)  # until the sidebar knows its tabs again
        opened.ask(PREPARE + "sidebar.active_panel_category = 'CityPV'; sidebar.tag_redraw()")
        time.sleep(1)
        yield opened
        opened.take_picture(pictures / "end.png")


STEPS = {
    "import_city": "surface",
    "classify": "kind",
    "trace": "diffuse_relative",
    "energy": "full_load_hours",
}


def test_buttons_do_their_steps_and_the_window_stays_alive(window):
    for operator, name in STEPS.items():
        press_step(
            window,
            f"citypv.{operator}",
            f"any('citypv_{name}' in mesh.attributes for mesh in bpy.data.meshes)",
        )
        if operator == "classify":
            undo_to_import(window)


def test_the_view_shows_the_city_in_many_colours_and_the_legend(window, tmp_path):
    import bpy

    window.point("mousemove", 400, 400)
    time.sleep(1)
    window.take_picture(tmp_path / "view.png")
    image = bpy.data.images.load(str(tmp_path / "view.png"))
    pixels = np.empty(len(image.pixels), dtype=np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(image.size[1], image.size[0], -1)[..., :3]
    left, bottom, width, height = window.ask(
        PREPARE
        + (
            "r = next(r for r in area.regions if r.type == 'WINDOW'); answer = (r.x, r.y, r.width, "
            "r.height)"
        )
    )
    # The colour bar lies 76 to 516 pixels from the view's left edge and 92 to 108 above its lower
    # one.
    scale = window.ask("answer = bpy.context.preferences.system.ui_scale")
    row, ends = (
        bottom + round(100 * scale),
        (left + round(77.5 * scale), left + round(514.5 * scale)),
    )
    first, last = pixels[row, ends[0]], pixels[row, ends[1]]
    np.testing.assert_allclose(first, np.array([0x44, 0x01, 0x54]) / 255, atol=0.04)
    np.testing.assert_allclose(last, np.array([0xFD, 0xE7, 0x25]) / 255, atol=0.04)
    seen = pixels[bottom + 200 : bottom + height - 150, left + 200 : left + width - 320]
    vivid = seen.max(axis=2) - seen.min(axis=2) > 0.3
    assert vivid.mean() > 0.02
    assert len(np.unique((seen[vivid] * 255).round().astype(int), axis=0)) >= 5


CITY = "bpy.data.objects['City']"
SELECTED = (
    f"mesh = {CITY}.data\n"
    "chosen = [face.index for face in mesh.polygons if face.select]\n"
    "kind = mesh.attributes['citypv_kind'].data\n"
    "answer = sorted({kind[face].value for face in chosen}), len(chosen)"
)


def wait_for_kinds(window, kinds):
    end = time.monotonic() + 20
    while window.ask(SELECTED)[0] != kinds and time.monotonic() < end:
        time.sleep(0.2)
    assert window.ask(SELECTED)[0] == kinds
    return window.ask(SELECTED)[1]


def test_a_button_of_the_report_highlights_its_faces_and_can_be_undone(window):
    press(window, 'citypv.select_group(group="kind/roof")')
    roof = CODES["kind"]["roof"]
    count = wait_for_kinds(window, [roof])
    assert window.ask(f"answer = {CITY}.mode, {CITY}['citypv_highlight']") == ["OBJECT", True]
    assert count == window.ask(
        f"answer = sum(a.value == {roof} for a in {CITY}.data.attributes['citypv_kind'].data)"
    )
    time.sleep(1)
    window.take_picture(window.pictures / "selected.png")
    press(window, 'citypv.select_group(group="kind/facade")')
    wait_for_kinds(window, [CODES["kind"]["facade"]])
    window.point("mousemove", 400, 400, "key", "ctrl+z")
    assert wait_for_kinds(window, [roof]) == count
    assert "Traceback" not in window.read_log()


def measure_frames(window, seconds):
    """Longest and median time between two turns of Blender's main loop [ms], which has to draw and
    answer in each.
    """
    window.ask(
        "import time\n"
        "space = bpy.app.driver_namespace\n"
        "space['ticks'], space['measuring'] = [], True\n"
        "def tick():\n"
        "    space['ticks'].append(time.perf_counter())\n"
        "    return 0.01 if space['measuring'] else None\n"
        "bpy.app.timers.register(tick)"
    )
    time.sleep(seconds)
    times = window.ask("s = bpy.app.driver_namespace; s['measuring'] = False; answer = s['ticks']")
    frames = 1000 * np.diff(times)
    return frames.max(), np.median(frames)


def test_escape_among_the_suns_keeps_those_that_are_traced(window):
    calm = measure_frames(window, 2)
    window.ask(
        "s = bpy.context.scene.citypv; s.suns, s.samples, s.shadow_samples = 'hourly', 64, 4096"
    )
    press(window, "citypv.trace")
    window.wait_for(f"{RUNNING}.text.startswith('suns') and {RUNNING}.share > 0.1", 120)
    window.take_picture(window.pictures / "running.png")
    frames = measure_frames(window, 5)
    (window.pictures / "frames.txt").write_text(
        "longest {:.0f} ms, median {:.0f} ms; {:.0f} and {:.0f} before".format(*frames, *calm)
    )
    window.point("mousemove", 400, 400, "key", "Escape")
    pressed = time.monotonic()
    window.wait_for(f"{RUNNING} is None or {RUNNING}.cancelled", 10)
    assert time.monotonic() - pressed < 2  # with the 0.2 s of asking
    window.wait_for(f"{RUNNING} is None", 60)
    # A computer that does other things as well takes longer, also where Blender does nothing.
    assert frames[0] < max(1000, 10 * calm[0])
    assert frames[1] < max(100, 10 * calm[1])
    told = window.ask(f"answer = {CITY}['citypv_interrupted']")
    assert told.startswith("Interrupted: kept ")
    assert told in read_reports(window)
    window.take_picture(window.pictures / "interrupted.png")
    assert "Traceback" not in window.read_log()


def test_bad_input_is_told_in_the_window_without_a_traceback(window):
    window.ask("bpy.context.scene.citypv.city_path = '/exchange/nowhere.gml'")
    press(window, "citypv.import_city")
    end = time.monotonic() + 20
    while "nowhere.gml" not in read_reports(window) and time.monotonic() < end:
        time.sleep(0.2)
    window.take_picture(window.pictures / "error.png")
    told = [line for line in read_reports(window).splitlines() if "nowhere.gml" in line]
    assert "/exchange/nowhere.gml: " in told[-1]
    assert "Traceback" not in window.read_log()
    assert window.ask("answer = 'City' in bpy.data.objects")
    window.point("key", "Escape")  # closes the message, which takes all keys


def test_the_command_line_runs_inside_blender(window):
    """`blender --command citypv` is the same program, with the same exit status."""
    tool, root = load_tool(), Path(ROOT)
    with pytest.raises(RuntimeError, match=r"nowhere\.gml"):
        tool.blender(root, "--command", "citypv", "inspect", "/exchange/nowhere.gml")
    told = tool.blender(
        root, "--command", "citypv", "inspect", f"/{tool.EXCHANGE}/{NAME}", "--json"
    )
    assert '"buildings": 3' in told.replace("building_count", "buildings")


def test_three_clicks_show_each_result_as_soon_as_it_is_there(window):
    three_clicks(window, f"/{load_tool().EXCHANGE}/{NAME}")


def test_the_probe_of_a_face(window):
    press(window, "citypv.probe", below=True)
    window.point("mousemove", *find_on_screen(window, "City", (0, -0.6, 0.8)), "click", 1)
    window.wait_for(f"'citypv_charts' in {CITY}")
    told = dict(line.split("|") for line in window.ask(f"answer = list({CITY}['citypv_probe'])"))
    assert told["Kind"] == "roof south" and told["Tilt"] == "36.9°"
    keep_picture(window, "probe")
    window.point("key", "Escape")
    assert "Traceback" not in window.read_log()


def test_a_tower_is_moved_with_live_on(window):
    """Its neighbours lose something else then, and what they lost before once that is undone,
    without tracing.
    """
    name = f"/{load_tool().EXCHANGE}/{NAME}"
    window.ask(
        f"s = bpy.context.scene.citypv; s.city_path, s.suns, s.days = {name!r}, 'days', 4\n"
        "s.samples, s.shadow_samples = 256, 16"
    )
    press(window, "citypv.solar_city")
    window.wait_for(f"{RUNNING} is not None", 20)
    window.wait_for(f"{RUNNING} is None", 600)
    before, after = move_tower(window)
    assert (
        all(row["change"] < -5 * row["error"] < 0 for row in (before, after))
        and before["change"] != after["change"]
    )
    undo_move(window, before)
    assert "Traceback" not in window.read_log()


@pytest.fixture
def no_tower(window):
    """The city of the tests before, without what they added."""
    window.ask(
        "bpy.data.batch_remove([item for item in bpy.data.objects if "
        "item.name.startswith('tower')])"
    )
    wait_until_settled(window, [])


def test_edits_while_an_update_is_computed(window, no_tower):
    """Undo at its first report, before its estimate and after that is shown; a tower deleted and
    its copy drawn in its place after that.
    """
    moments = {undo: (0, -2, -1), replace: (-1,)}
    made = edit_at_moments(
        window, lambda edit, every: [every[number] for number in moments.get(edit, ())]
    )
    assert made == 4
    assert "Traceback" not in window.read_log()


@pytest.mark.thorough
def test_all_edits_at_all_moments_of_an_update(window, no_tower):
    """Undo, redo, delete, duplicate, and both, at each report of its work and around its estimate:
    none crashes.
    """
    assert edit_at_moments(window, lambda edit, every: every) >= 35
    assert "Traceback" not in window.read_log()


def test_the_first_city_is_undone_while_it_is_computed(window):
    undo_first_city(window, f"/{load_tool().EXCHANGE}/{NAME}")
    assert "Traceback" not in window.read_log()


def test_a_repeat_does_its_step_in_the_background(window, city_file):
    """F9 after an import, with another file, and Shift R after *Classify*: the window's own thread
    does none of the work.
    """
    folder = f"/{load_tool().EXCHANGE}"
    shutil.copy(city_file, Path(ROOT) / folder[1:] / "other.gml")
    worked = repeat_steps(window, f"{folder}/{NAME}", f"{folder}/other.gml")
    assert worked == [[label, False] for label in ["Import city"] * 2 + ["Classify surfaces"] * 2]
    assert "Traceback" not in window.read_log()
