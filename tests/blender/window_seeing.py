"""Timeline and frames in a Blender window."""

import time

import numpy as np
from window_steps import RUNNING, press

LIGHT = (
    "a = bpy.data.objects['City'].data.attributes['citypv_direct_irradiance'].data\n"
    "answer = sum(one.value for one in a), bpy.context.scene.frame_current, bpy.data.objects['City']['citypv_moment']"
)
IS_LIT = "any('citypv_direct_irradiance' in mesh.attributes for mesh in bpy.data.meshes)"


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
