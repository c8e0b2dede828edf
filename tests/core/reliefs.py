"""Terrain for files of buildings: triangulated heights as CityGML and CityJSON write them."""

import numpy as np
from citygml_text import wrap
from scipy.spatial import Delaunay
from small_city import EAST, NORTH, UP

DEM = "http://www.opengis.net/citygml/relief/2.0"


def hill(x, y):
    """[m] Above the small city's level."""
    return 0.06 * x + 0.02 * y + 1.5 * np.sin(x / 25.0)


def tin(low=(-150.0, -150.0), high=(180.0, 180.0), step=11.0, height=hill, seed=1):
    """Points (n, 3) and triangles (t, 3) of a Delaunay triangulation; off the grid, so that nothing
    ties.
    """
    x, y = (np.arange(a, b + 0.5 * step, step) for a, b in zip(low, high, strict=True))
    places = np.column_stack([axis.ravel() for axis in np.meshgrid(x, y)])
    places = np.round(
        places + np.random.default_rng(seed).uniform(-0.3, 0.3, places.shape) * step, 3
    )
    return np.column_stack([places, height(*places.T)]).round(3), Delaunay(places).simplices


def relief(points, triangles, *, lod="2", move=(EAST, NORTH, UP), srs_name="", envelope=""):
    """A ReliefFeature with one TINRelief, inside a cityObjectMember."""
    patches = ""
    for corners in np.asarray(points)[np.asarray(triangles)] + np.asarray(move):
        patches += triangle(" ".join(f"{value:.9f}" for value in corners[[0, 1, 2, 0]].ravel()))
    srs = f' srsName="{srs_name}"' if srs_name else ""
    surface = f"<gml:TriangulatedSurface{srs}>{wrap(patches, 'gml:trianglePatches')}</gml:TriangulatedSurface>"
    component = wrap(
        f"<dem:lod>{lod}</dem:lod>{wrap(surface, 'dem:tin')}",
        "dem:reliefComponent",
        "dem:TINRelief",
    )
    head = f'<dem:ReliefFeature xmlns:dem="{DEM}" gml:id="r">{envelope}<dem:lod>{lod}</dem:lod>'
    return f"<cityObjectMember>{head}{component}</dem:ReliefFeature></cityObjectMember>\n"


def triangle(ring):
    """A triangle of a TriangulatedSurface by the numbers of its closed ring."""
    return wrap(ring, "gml:Triangle", "gml:exterior", "gml:LinearRing", "gml:posList")


def only(city):
    """The one layer of a city's own terrain."""
    (layer,) = city.terrain.layers
    return layer


def told(scene, words):
    """Whether a note of the report holds some words."""
    return any(words in note for note in scene.report.notes)
