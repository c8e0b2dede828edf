"""Timeline, before and after, and frames, in a Blender window."""

import time

import numpy as np
from window_steps import RUNNING, press

LIGHT = (
    "a = bpy.data.objects['City'].data.attributes['citypv_direct_irradiance'].data\n"
    "answer = sum(one.value for one in a), bpy.context.scene.frame_current, bpy.data.objects['City']['citypv_moment']"
)
IS_LIT, IS_COMPARED = (
    f"any('citypv_{name}' in mesh.attributes for mesh in bpy.data.meshes)"
    for name in ("direct_irradiance", "change_of_full_load_hours")
)


def scrub_timeline(window):
    """Start the timeline, move on by keys, and end it."""
    world = window.ask("answer = bpy.context.scene.world.name")
    press(window, "citypv.timeline", below=True)
    window.wait_for(IS_LIT)
    window.wait_for(f"{RUNNING} is None")
    noon, frame, moment = window.ask(LIGHT)
    assert moment.startswith("June 12–13 h")
    window.point("mousemove", 400, 400, *["key", "Right"] * 6)
    window.wait_for(f"bpy.context.scene.frame_current == {frame + 6}")
    evening, _, moment = window.ask(LIGHT)
    assert moment.startswith("June 18–19 h")
    assert 0 < evening < noon
    time.sleep(1)
    window.take_picture(window.pictures / "timeline.png")
    press(window, "citypv.stop_timeline", below=True)
    window.wait_for("bpy.context.scene.frame_end == 250")
    assert window.ask("answer = bpy.context.scene.world.name, bpy.data.objects.get('CityPV sun')") == [world, None]
    assert "Traceback" not in window.read_log()


def compare_albedos(window):
    """Keep a result, compute one of brighter walls, look at both."""
    press(window, "citypv.keep_before", below=True)
    window.wait_for("'City before' in bpy.data.objects")
    window.ask("bpy.context.scene.citypv.albedo = 0.6")
    press(window, "citypv.solar_city")
    window.wait_for(IS_COMPARED)
    window.wait_for(f"{RUNNING} is None")
    change = window.ask(
        "c = bpy.data.objects['City']\n"
        "a = [one.value for one in c.data.attributes['citypv_change_of_full_load_hours'].data]\n"
        "answer = [v for v in a if v == v], list(c['citypv_changes'])"
    )
    assert max(change[0]) > 1
    assert change[1][0].startswith("All|")
    window.ask("bpy.context.scene.citypv_seeing.side_by_side = True")
    time.sleep(1)
    window.point("mousemove", 400, 400, "key", "Home")
    time.sleep(2)
    window.take_picture(window.pictures / "before_after.png")
    window.ask("bpy.ops.citypv.forget_before(); bpy.context.scene.citypv.albedo = 0.2")
    assert not window.ask("answer = 'City before' in bpy.data.objects")
    assert "Traceback" not in window.read_log()


def measure_frames(window, seconds):
    """Longest and median time between two turns of Blender's main loop [ms], which has to draw and answer in each."""
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
