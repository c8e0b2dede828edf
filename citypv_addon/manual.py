"""*Online Manual* of each button and setting: the manual's pages that the extension brings
along.
"""

from pathlib import Path

ROOT = Path(__file__).parent.parent
# What is asked about, as Blender names it -> the page; the first that fits counts.
PAGES = (
    ("bpy.ops.citypv.berlin_example*", "guide/tutorial.html"),
    ("bpy.ops.citypv.solar_city*", "guide/blender.html#one-button"),
    ("bpy.ops.citypv.take_meshes*", "guide/blender.html#your-own-meshes-as-a-city"),
    ("bpy.ops.citypv.*city*", "guide/your_city.html"),
    ("bpy.ops.citypv.*building*", "guide/variants_blender.html"),
    ("bpy.ops.citypv.*variant*", "guide/variants_blender.html"),
    ("bpy.ops.citypv.*update*", "guide/variants_blender.html"),
    ("bpy.ops.citypv.*before*", "guide/variants_blender.html"),
    ("bpy.ops.citypv.compare*", "guide/variants_blender.html"),
    ("bpy.ops.citypv.plan_effects*", "reference/effects.html"),
    ("bpy.ops.citypv.explain_effect*", "reference/effects.html"),
    ("bpy.ops.citypv.predict*", "reference/accuracy.html"),
    ("bpy.ops.citypv.use_preset*", "reference/accuracy.html"),
    ("bpy.ops.citypv.energy*", "guide/your_plant.html"),
    ("bpy.ops.citypv.find_module*", "guide/your_plant.html"),
    ("bpy.ops.citypv.*weather*", "guide/weather.html"),
    ("bpy.ops.citypv.*terrain*", "guide/your_city.html#ground-and-terrain"),
    ("bpy.ops.citypv.*horizon*", "guide/your_city.html#ground-and-terrain"),
    ("bpy.ops.citypv.*albedo*", "reference/materials.html"),
    ("bpy.types.settings.*weather*", "guide/weather.html"),
    ("bpy.types.settings.*", "options/simulate.html"),
    ("bpy.*citypv*", "guide/blender.html"),
)


def find_manual():
    """Address of the manual: of the extension, or as `make docs` built it; None if it is not
    there.
    """
    folders = (ROOT / "manual", ROOT / "build/docs")
    folder = next((folder for folder in folders if (folder / "index.html").exists()), None)
    return folder and f"{folder.as_uri()}/"


def map_manual():
    """Pages for Blender's *Online Manual*: prefix, and a page for each pattern."""
    manual = find_manual()
    return manual or "", PAGES if manual else ()


def draw_manual(layout):
    """A menu entry that opens the manual, where it is there."""
    if manual := find_manual():
        layout.operator("wm.url_open", text="Manual", icon="HELP").url = f"{manual}index.html"
