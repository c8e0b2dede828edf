"""The legend of the rendered picture: colour bar, title, unit and ticks as objects parented to the
camera.
"""

from pathlib import Path

import bpy
import numpy as np

from ..city.attributes import CHANGE, RESULTS
from ..city.build_meshes import remove_objects
from ..city.edit_marks import describe_edit
from ..city.keys import Key
from .colour_faces import MATERIAL, linear_colour, start_emission, write_colours

DISTANCE = 1.0  # of the legend's plane in front of the camera [m]
# property of the city, by owner of the attribute
NOTES = {
    "energy": Key.WEATHER,
    "timeline": Key.MOMENT,
}

# Layout in fractions of the picture's height, from its lower left corner.
LEFT, BAR_BOTTOM, BAR_WIDTH, BAR_HEIGHT = 0.055, 0.085, 0.62, 0.026
TEXT_SIZE, GAP = 0.028, 0.014


def build_legend(scene, camera, scale, note="", *, name="CityPV legend"):
    """Build the legend of a scale in front of a camera, replacing an earlier one.

    Parameters
    ----------
    scene : bpy.types.Scene
        Gives the size of the picture.
    camera : bpy.types.Object
    scale : ColourScale
    note : str
        What else has to be read beside the colours, such as the weather.

    Returns
    -------
    bpy.types.Collection
        The legend's objects; linked to the scene.
    """
    collection = bpy.data.collections.get(name) or bpy.data.collections.new(name)
    remove_objects(*collection.objects)
    if collection.name not in scene.collection.children:
        scene.collection.children.link(collection)
    page = _Page(scene, camera, collection)
    page.write(scale.heading(), LEFT, BAR_BOTTOM + BAR_HEIGHT + GAP, 0.036)
    below = BAR_BOTTOM - GAP - 0.75 * TEXT_SIZE
    if note:
        page.write(note, page.width - LEFT, below, TEXT_SIZE, "RIGHT")
    # A strip of narrow faces in the material of the city.
    edges = np.linspace(0.0, 1.0, 1 + (len(scale.classes) or 256))
    bar = page.strip(
        BAR_WIDTH * edges, BAR_HEIGHT, (LEFT, BAR_BOTTOM), bpy.data.materials[MATERIAL]
    )
    middles = scale.low + (edges[:-1] + edges[1:]) / 2 * (scale.high - scale.low)
    write_colours(bar, scale.colours(middles))
    for share, text in scale.labels():
        place = LEFT + BAR_WIDTH * share
        if not scale.classes:
            page.strip(np.array([0.0, 0.0016]), 0.008, (place - 0.0008, BAR_BOTTOM - 0.008))
        page.write(text, place, below, TEXT_SIZE, "CENTER")
    return collection


def note_of(city, attribute):
    """What is to be read beside an attribute's colours: earlier state, meaning of grey, suns kept,
    weather, moment.
    """
    owner = RESULTS[attribute].owner if attribute in RESULTS else ""
    earlier = city.get(Key.PREVIEW) or ("before the last edit" if describe_edit(city)[0] else "")
    grey = (
        "grey: new, or below two standard errors" if attribute == CHANGE + "full_load_hours" else ""
    )
    of_result = city.get(NOTES[owner], "") if owner in NOTES else ""
    kept = city.get(Key.INTERRUPTED, "") if owner in ("transfer", "energy") else ""
    return "; ".join(filter(None, (earlier, grey, kept, of_result)))


class _Page:
    """The plane in front of the camera; positions and sizes in fractions of the picture's
    height.
    """

    def __init__(self, scene, camera, collection):
        render = scene.render
        self.width = render.resolution_x / render.resolution_y
        # The corners of the picture at the legend's distance give its scale and its middle (of
        # shifted lenses).
        corners = np.array([tuple(corner) for corner in camera.data.view_frame(scene=scene)])
        if camera.data.type != "ORTHO":
            corners *= DISTANCE / -corners[:, 2:]
        low, high = corners.min(axis=0), corners.max(axis=0)
        self.scale, self.middle = float(high[1] - low[1]), (low + high) / 2
        self.camera, self.collection = camera, collection
        start_emission("CityPV ink")[2].default_value = linear_colour("23282d")
        self.ink = bpy.data.materials["CityPV ink"]
        # Blender's own interface font, packed into the file; its text font where it ships without.
        path = Path(bpy.utils.system_resource("DATAFILES", path="fonts") or "", "Inter.woff2")
        self.font = bpy.data.fonts.load(str(path), check_existing=True) if path.is_file() else None
        if self.font is not None and self.font.packed_file is None:
            self.font.pack()

    def write(self, text, x, y, size, align="LEFT"):
        """Write a line of text whose baseline starts (or is centred, or ends) at x, y."""
        curve = bpy.data.curves.new("CityPV text", "FONT")
        curve.body, curve.size, curve.align_x = text, size * self.scale, align
        if self.font is not None:
            curve.font = self.font
        self._hang("CityPV text", curve, self.ink, x, y)

    def strip(self, edges, height, place, material=None):
        """Draw a strip from a place on, one face between two edges, in ink or a material; return
        its mesh.
        """
        vertices = [
            (float(x) * self.scale, y * self.scale, 0.0) for x in edges for y in (0.0, height)
        ]
        faces = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(len(edges) - 1)]
        mesh = bpy.data.meshes.new("CityPV legend")
        mesh.from_pydata(vertices, [], faces)
        self._hang(
            "CityPV tick" if material is None else "CityPV colour bar",
            mesh,
            material or self.ink,
            *place,
        )
        return mesh

    def _hang(self, name, data, material, x, y):
        data.materials.append(material)
        item = bpy.data.objects.new(name, data)
        item[Key.PART], item.parent, item.hide_select = "legend", self.camera, True
        across, up = self.middle[:2].tolist()
        item.location = (
            across + (x - self.width / 2) * self.scale,
            up + (y - 0.5) * self.scale,
            -DISTANCE,
        )
        self.collection.objects.link(item)
