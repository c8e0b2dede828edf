"""The legend of the rendered picture: colour bar, title, unit and ticks as objects parented to the camera."""

from pathlib import Path

import bpy
import numpy as np

from ..attributes import PREFIX, RESULTS, write_face_attribute
from .colour_faces import MATERIAL, build_plain_material, format_tick

INK = "23282d"
DISTANCE = 1.0  # of the legend's plane in front of the camera [m]
COLLECTION = "CityPV legend"
FONT = "Inter.woff2"

# Layout in fractions of the picture's height, from its lower left corner.
LEFT, BAR_BOTTOM, BAR_WIDTH, BAR_HEIGHT = 0.055, 0.085, 0.62, 0.026
TITLE_SIZE, TEXT_SIZE, GAP = 0.036, 0.028, 0.014


def build_legend(scene, camera, scale, note=""):
    """Build the legend of a scale in front of a camera, replacing an earlier one.

    Parameters
    ----------
    scene : bpy.types.Scene
        Gives the size of the picture.
    camera : bpy.types.Object
    scale : operators.colour_scale.ColourScale
    note : str
        What else has to be read beside the colours, such as the weather.

    Returns
    -------
    bpy.types.Collection
        The legend's objects; linked to the scene.
    """
    collection = _empty_collection(scene)
    page = _Page(scene, camera, collection)
    title = f"{scale.title} [{scale.unit}]" if scale.unit else scale.title
    page.write(title, LEFT, BAR_BOTTOM + BAR_HEIGHT + GAP, TITLE_SIZE)
    if note:
        page.write(note, page.width - LEFT, BAR_BOTTOM - GAP - 0.75 * TEXT_SIZE, TEXT_SIZE, "RIGHT")
    (_draw_classes if scale.classes else _draw_bar)(page, scale)
    return collection


def load_font():
    """Load Blender's own interface font, packed into the file; None (Blender's text font) where it ships without."""
    path = Path(bpy.utils.system_resource("DATAFILES", path="fonts") or "", FONT)
    if not path.is_file():
        return None
    font = bpy.data.fonts.load(str(path), check_existing=True)
    if font.packed_file is None:
        font.pack()
    return font


def _draw_bar(page, scale):
    # A strip of narrow faces with the attribute itself, in the material of the city.
    page.strip(np.linspace(scale.low, scale.high, 257), scale)
    for tick in scale.ticks:
        place = LEFT + BAR_WIDTH * (tick - scale.low) / (scale.high - scale.low)
        page.rectangle(place - 0.0008, BAR_BOTTOM - 0.008, 0.0016, 0.008)
        page.write(format_tick(tick, scale), place, BAR_BOTTOM - GAP - 0.75 * TEXT_SIZE, TEXT_SIZE, "CENTER")


def _draw_classes(page, scale):
    page.strip(np.arange(len(scale.classes) + 1) - 0.5, scale)
    for code, name in enumerate(scale.classes):
        place = LEFT + BAR_WIDTH * (code + 0.5) / len(scale.classes)
        page.write(name, place, BAR_BOTTOM - GAP - 0.75 * TEXT_SIZE, TEXT_SIZE, "CENTER")


class _Page:
    """The plane in front of the camera; positions and sizes in fractions of the picture's height."""

    def __init__(self, scene, camera, collection):
        render = scene.render
        self.width = render.resolution_x / render.resolution_y
        # The corners of the picture at the legend's distance give its scale and its middle (of shifted lenses).
        corners = np.array([tuple(corner) for corner in camera.data.view_frame(scene=scene)])
        if camera.data.type != "ORTHO":
            corners *= DISTANCE / -corners[:, 2:]
        low, high = corners.min(axis=0), corners.max(axis=0)
        self.scale, self.middle = float(high[1] - low[1]), (low + high) / 2
        self.camera, self.collection = camera, collection
        self.ink = build_plain_material("CityPV ink", INK)
        self.font = load_font()

    def write(self, text, x, y, size, align="LEFT"):
        """Write a line of text whose baseline starts (or is centred, or ends) at x, y."""
        curve = bpy.data.curves.new("CityPV text", "FONT")
        curve.body, curve.size, curve.align_x = text, size * self.scale, align
        if self.font is not None:
            curve.font = self.font
        curve.materials.append(self.ink)
        self._hang(bpy.data.objects.new("CityPV text", curve), x, y)

    def rectangle(self, x, y, width, height):
        """Draw a filled rectangle of ink."""
        mesh = _strip_mesh(np.array([0.0, width]) * self.scale, height * self.scale)
        mesh.materials.append(self.ink)
        self._hang(bpy.data.objects.new("CityPV tick", mesh), x, y)

    def strip(self, edges, scale):
        """Draw the colour bar: one face between two edges, with the value in its middle."""
        span = (edges - edges[0]) / (edges[-1] - edges[0])
        mesh = _strip_mesh(span * BAR_WIDTH * self.scale, BAR_HEIGHT * self.scale)
        middles = (edges[:-1] + edges[1:]) / 2
        write_face_attribute(mesh, scale.attribute, np.rint(middles).astype(int) if scale.classes else middles)
        mesh.materials.append(bpy.data.materials[MATERIAL])
        self._hang(bpy.data.objects.new("CityPV colour bar", mesh), LEFT, BAR_BOTTOM)

    def _hang(self, item, x, y):
        item[PREFIX + "part"] = "legend"
        item.parent = self.camera
        across, up = float(self.middle[0]), float(self.middle[1])
        item.location = (across + (x - self.width / 2) * self.scale, up + (y - 0.5) * self.scale, -DISTANCE)
        item.hide_select = True
        self.collection.objects.link(item)


def _strip_mesh(edges, height):
    count = len(edges) - 1
    vertices = [(float(x), y, 0.0) for x in edges for y in (0.0, float(height))]
    faces = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(count)]
    mesh = bpy.data.meshes.new("CityPV legend")
    mesh.from_pydata(vertices, [], faces)
    return mesh


def _empty_collection(scene):
    collection = bpy.data.collections.get(COLLECTION) or bpy.data.collections.new(COLLECTION)
    for item in list(collection.objects):
        data = item.data
        bpy.data.objects.remove(item)
        (bpy.data.curves if isinstance(data, bpy.types.Curve) else bpy.data.meshes).remove(data)
    if collection.name not in scene.collection.children:
        scene.collection.children.link(collection)
    return collection


MOMENT = PREFIX + "moment"  # of the timeline, as text
NOTES = {"energy": PREFIX + "weather", "timeline": MOMENT}  # property of the city, by owner of the attribute


def note_of(city, attribute):
    """Weather or moment that an attribute belongs to, as text; "" for attributes that depend on neither."""
    owner = RESULTS[attribute].owner if attribute in RESULTS else ""
    return city.get(NOTES.get(owner, ""), "") if owner in NOTES else ""
