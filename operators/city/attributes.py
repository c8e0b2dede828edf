"""Face attributes in Blender: names, codes, titles and units, written from arrays of core and read
back.

Every attribute is called `citypv_` + name and lives on the faces (domain FACE).

| name | type | meaning |
|---|---|---|
| `surface` | INT | polygon of the city, the row of faces.csv; -1 on ground that was generated |
| `building` | INT | place in the list `citypv_buildings` of the object; on the city only |
| `kind`, `orientation` | INT | codes of `CODES`, also kept on the object |
| the names of `RESULTS` | FLOAT | NaN where there is no such result, as on generated ground |

Attributes of `_VIEWS` exist in Blender only: moments of the timeline, and differences from the
result kept as *before*.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.results.columns import COLUMNS, Column
from ...core.settings.errors import InputError

PREFIX = "citypv_"

CODES = {
    "kind": {
        "facade": 0,
        "roof": 1,
        "flat": 2,
        "steep": 3,
        "downward": 4,
        "ground": 5,
        "rack": 6,
    },
    "orientation": {
        # As in files of 0.2.0, which had four orientations.
        "none": 0,
        "north": 1,
        "east": 2,
        "south": 3,
        "west": 4,
        "northeast": 5,
        "southeast": 6,
        "southwest": 7,
        "northwest": 8,
    },
}
# results stored as face attributes
QUANTITIES = tuple(column for column in COLUMNS if column.title)
CHANGE = "change_of_"  # begins the name of a difference from the result kept as *before*
CHANGE_ERROR = "full_load_hours_change_standard_error"
_VIEWS = tuple(
    Column(name, owner, title, "", title=title, legend_unit=unit)
    for name, owner, title, unit in (
        ("direct_irradiance", "timeline", "Direct irradiance", "W/m²"),
        ("month_hours", "timeline", "Hours of the month", "h"),
        (
            CHANGE_ERROR,
            "energy",
            "Standard error of the change of the full load hours",
            "h per year",
        ),
        *(
            (CHANGE + q.name, q.owner, f"Change: {q.title}", q.legend_unit)
            for q in QUANTITIES
            if q.name in ("full_load_hours", "poa_global_annual", "sky_view_factor")
        ),
        ("module_hours", "energy", "Full load hours of faces with modules", "h per year"),
    )
)
RESULTS = {quantity.name: quantity for quantity in (*QUANTITIES, *_VIEWS)}
_TYPES = {"INT": np.int32, "FLOAT": np.float32}


def write_face_attribute(mesh, name, values):
    """Write one number per face as the attribute `citypv_` + name.

    Parameters
    ----------
    mesh : bpy.types.Mesh
        A mesh of f faces.
    name : str
        Name without the prefix.
    values : (f,) array of int or float
        Integers become an INT, floats a FLOAT attribute of the domain FACE.
    """
    values = np.asarray(values)
    data_type = "INT" if values.dtype.kind in "iu" else "FLOAT"
    attribute = mesh.attributes.get(PREFIX + name)
    if attribute is not None and (attribute.data_type, attribute.domain) != (data_type, "FACE"):
        mesh.attributes.remove(attribute)
        attribute = None
    if attribute is None:
        attribute = mesh.attributes.new(PREFIX + name, data_type, "FACE")
    attribute.data.foreach_set("value", np.ascontiguousarray(values, dtype=_TYPES[data_type]))


def read_face_attribute(mesh, name):
    """Read the attribute `citypv_` + name: (f,) int32 or float32, or None if the mesh has no such
    attribute.
    """
    attribute = mesh.attributes.get(PREFIX + name)
    if attribute is None:
        return None
    return read_array(attribute.data, "value", dtype=_TYPES[attribute.data_type])


def read_array(items, name, width=1, dtype=np.float32):
    """Read a property of all vertices, loops or faces of a mesh: (n,), or (n, width) for
    vectors.
    """
    values = np.empty(width * len(items), dtype)
    items.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)


def read_corners(mesh):
    """Vertex of each corner of a mesh's faces: (l,) int32."""
    return read_array(mesh.loops, "vertex_index", dtype=np.int32)


@dataclass
class Faces:
    """The faces of a city and of its generated ground, to write results of surfaces on."""

    city: Any  # bpy.types.Object, as `build_meshes` makes it
    ground: Any = None  # bpy.types.Object, or None

    def write_classes(self, surfaces):
        """Write kind and orientation as codes to the faces, and the code tables to the objects.

        Parameters
        ----------
        surfaces : core.city.scene.Surfaces
            n surfaces.
        """
        faces = self._faces_of_surfaces(len(surfaces))
        for name, codes in CODES.items():
            words, place = np.unique(np.asarray(getattr(surfaces, name)), return_inverse=True)
            of_surfaces = np.array([codes[word] for word in words.tolist()], np.int32)[place]
            write_face_attribute(self.city.data, name, of_surfaces[faces])
            if self.ground is not None:
                of_ground = codes["ground" if name == "kind" else "none"]
                write_face_attribute(
                    self.ground.data, name, np.full(len(self.ground.data.polygons), of_ground)
                )
            for item in filter(None, (self.city, self.ground)):
                item[f"{PREFIX}{name}_codes"] = codes

    def write_results(self, transfer, energy=None):
        """Write results per surface to the faces; generated ground gets NaN.

        Parameters
        ----------
        transfer : core.light.transfer.Transfer
            Results of n surfaces.
        energy : core.energy.energy.Energy, optional
            Results of the same surfaces; without it, attributes of an earlier energy are removed.
        """
        for quantity in QUANTITIES:
            if energy is not None or quantity.owner != "energy":
                self.write_values(quantity.name, quantity.values_of(transfer, energy))
        if energy is not None:
            self.write_values("module_hours", _hours_of_modules(transfer, energy))
        else:
            gone = [quantity for quantity in QUANTITIES if quantity.owner == "energy"]
            self.remove(*(one.name for one in (*gone, *_VIEWS)))

    def write_values(self, name, values):
        """Write one number per surface, (n,), to the faces as the attribute `citypv_` + name;
        generated ground gets NaN.
        """
        values = np.asarray(values, dtype=np.float64)
        write_face_attribute(self.city.data, name, values[self._faces_of_surfaces(len(values))])
        if self.ground is not None:
            write_face_attribute(
                self.ground.data, name, np.full(len(self.ground.data.polygons), np.nan)
            )

    def remove(self, *names):
        """Remove the attributes `citypv_` + name, where they are."""
        for attributes in (
            item.data.attributes for item in (self.city, self.ground) if item is not None
        ):
            for name in names:
                if PREFIX + name in attributes:
                    attributes.remove(attributes[PREFIX + name])

    def _faces_of_surfaces(self, count):
        # Every face stores its surface; an edited mesh may have too few or too many.
        faces = read_face_attribute(self.city.data, "surface")
        if faces is None or len(faces) == 0 or faces.min() < 0 or faces.max() >= count:
            raise InputError(
                self.city.name,
                "its faces do not match the surfaces that were traced",
                "classify the city again",
            )
        return faces


def _hours_of_modules(transfer, energy):
    """Full load hours of the modules of each surface, NaN where it carries none: (n,)."""
    # Hours are means over whole surfaces; modules lie on the area that counts.
    energy_of_modules = energy.kwp_of_hours(transfer.surfaces.area) * energy.full_load_hours
    carries = energy.kwp > 0
    return np.divide(
        energy_of_modules, energy.kwp, out=np.full(len(carries), np.nan), where=carries
    )
