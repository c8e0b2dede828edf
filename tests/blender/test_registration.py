"""Enabling the add-on is quick, loads nothing heavy, and can be taken back."""

import subprocess
import sys
from pathlib import Path

import bpy
import pytest
from steps import refuse

import citypv


@pytest.mark.parametrize("step", ["classify", "trace", "energy", "colour", "render"])
def test_a_step_waits_for_the_one_before(addon, step):
    assert not getattr(bpy.ops.citypv, step).poll()
    refuse(step, r"poll\(\) .*(first|Import)")


def list_traces():
    """All that an add-on can leave: types, operators, properties, handlers, menu entries,
    key maps.
    """
    owners = (
        bpy.types.Scene,
        bpy.types.Material,
        bpy.types.Object,
        bpy.types.Mesh,
        bpy.types.WindowManager,
    )
    lists = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)}
    draws = {name: getattr(getattr(bpy.types, name), "draw", None) for name in dir(bpy.types)}
    keys = bpy.context.window_manager.keyconfigs.addon
    return {
        "types": set(dir(bpy.types)),
        "operators": set(dir(bpy.ops.citypv)),
        "properties": {
            (owner.__name__, name)
            for owner in owners
            for name in owner.bl_rna.properties.keys()  # noqa: SIM118
        },
        "attributes": {(owner.__name__, name) for owner in owners for name in vars(owner)},
        "handlers": {
            (name, str(item))
            for name, items in lists.items()
            if isinstance(items, list)
            for item in items
        },
        "menus": {
            (name, str(item))
            for name, draw in draws.items()
            for item in getattr(draw, "_draw_funcs", ())
        },
        "manual": {prefix for prefix, _ in bpy.utils.manual_map()},
        "keys": {
            (map_.name, item.idname)
            for map_ in (keys.keymaps if keys else ())
            for item in map_.keymap_items
        },
    }


def test_disabling_leaves_nothing_in_blender():
    citypv.register()  # subclasses of Blender's types are listed once the modules are imported
    citypv.unregister()
    before = list_traces()
    citypv.register()
    during = list_traces()
    assert during["types"] > before["types"]
    assert {owner for owner, _ in during["properties"] - before["properties"]} >= {
        "Scene",
        "Material",
    }
    assert during["handlers"] > before["handlers"] and during["menus"] > before["menus"]
    citypv.unregister()
    citypv.unregister()  # a second time does nothing
    assert list_traces() == before


# -- the example for scripts runs as its text says --

EXAMPLE = Path(__file__).parents[2] / "examples" / "headless.py"
# The example as a script, with two rays per pixel instead of sixteen.
RUN = (
    "import runpy, sys; from citypv.operators.show import draw_results; draw_results.SAMPLES = "
    "2; "
    "sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name='__main__')"
)


@pytest.mark.slow
def test_the_example_writes_what_it_says(city_file, tmp_path):
    """Under plain Python with bpy, in a process of its own."""
    given = [sys.executable, "-c", RUN, str(EXAMPLE), str(city_file), str(tmp_path)]
    done = subprocess.run(given, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "city.blend").stat().st_size > 10_000
    assert (tmp_path / "city.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "city.City.citypv.nc").is_file()
    assert "All: " in done.stdout
    assert " MWh per year" in done.stdout
