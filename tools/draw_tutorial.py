"""Take the pictures of docs/guide/tutorial.md in a real Blender window (see blender_window.py).

.venv/bin/python tools/draw_tutorial.py ROOT
"""

import shutil
import sys
import time
from pathlib import Path

import blender_window

DOCS = Path(__file__).resolve().parent.parent / "docs/guide"
SIZE = (1280, 800)
PLACE = """
window = bpy.context.window_manager.windows[0]
area = next(a for a in window.screen.areas if a.type == 'VIEW_3D')
sidebar = next(r for r in area.regions if r.type == 'UI')
view = next(r for r in area.regions if r.type == 'WINDOW')
"""
TAB = "sidebar.active_panel_category = 'CityPV'; sidebar.tag_redraw()"
RUN = (
    "with bpy.context.temp_override(window=window, area=area, region=view): "
    "bpy.ops.citypv.berlin_example()"
)
RUNNING = "__import__('importlib').import_module('bl_ext.user_default.citypv.operators.city.run_step').Step.current"


LOOK = "any(one.get('citypv_interrupted', '').startswith('First look') for one in bpy.data.objects)"


def main():
    """Install the extension, run the Berlin example, and take a picture before, during
    and after.
    """
    root = Path(sys.argv[1]).resolve()
    blender_window.install_extension(root)
    with blender_window.Window(root, SIZE) as window:
        window.ask("for item in list(bpy.data.objects): bpy.data.objects.remove(item)", 200)
        window.ask(PLACE + "area.spaces.active.show_region_ui = True")
        time.sleep(5)
        window.ask(PLACE + TAB)
        time.sleep(5)
        take_picture(window, "start")
        window.ask(PLACE + RUN, 60)
        window.wait_for(LOOK, 900)
        time.sleep(5)  # until panels have moved to their places
        take_picture(window, "running")
        window.wait_for(f"{RUNNING} is None", 900)
        time.sleep(5)
        take_picture(window, "done")


def take_picture(window, name):
    """Save a screenshot with few colours, which is small."""
    path = DOCS / f"tutorial_{name}.png"
    window.take_picture(path)
    if shutil.which("mogrify"):
        blender_window.run(["mogrify", "-strip", "+dither", "-colors", "256", path])


if __name__ == "__main__":
    main()
