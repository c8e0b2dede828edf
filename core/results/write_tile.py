"""One tile of a solar map: glTF 2.0 with EXT_mesh_features and EXT_structural_metadata, as 3D Tiles
1.1 has it.

Surfaces are features, whose numbers stand in a property table. Colours show the full load hours,
for viewers that know nothing else of the map.
"""

import numpy as np

from .colour_map import GROUND, linear_light, srgb_colour, srgb_light
from .glb import (
    ARRAY,
    ELEMENTS,
    FLOAT,
    UINT8,
    UINT16,
    UINT32,
    Buffer,
    colour_hours,
    pack_glb,
    plain_material,
)
from .viewer_columns import VIEWED


def compose_tile(shapes, columns, ground, middle, *, level, enums, copyright, colour=""):
    """A tile of the map in 3D as bytes of a GLB: a mesh with colours, and a table of values.

    Parameters
    ----------
    shapes : Shapes
    columns : dict of str to array
        A value for each feature: (n,) float32, uint8, uint32 or str. Of `hours` are the colours; of
        `tilt` and `azimuth` [°], where they are there, the shade.
    ground : (Shapes of one feature) or None
    middle : (3,) float [m]
        Place of the tile in the map's frame.
    level : (float, float)
        Hours of the lowest and the highest colour.
    enums : dict of str to list of str
        Columns of whole numbers that are places in a list of names.
    copyright : str
    colour : str
        Of modules, which have one colour; empty for surfaces.
    """
    # A tile of the map in 3D, as a glTF with numbers for each surface. Corners relative to the
    # middle of the tile, with colour and number of the surface that each belongs to.
    buffer, ids = Buffer(), shapes.feature.astype("<f4")
    looks = {}
    if not colour:
        colours = _colour_features(columns, level)[shapes.feature]
        looks["COLOR_0"] = buffer.access(colours, UINT8, "VEC4", ARRAY, normalized=True)
    attributes = {
        "POSITION": buffer.place(shapes.corners - middle),
        **looks,
        "_FEATURE_ID_0": buffer.access(ids, FLOAT, "SCALAR", ARRAY),
    }
    count = len(columns["hours"])
    features = {"featureIds": [{"featureCount": count, "attribute": 0, "propertyTable": 0}]}
    surfaces = {"attributes": attributes, "indices": _index(buffer, shapes), "material": 0}
    primitives = [surfaces | {"extensions": {"EXT_mesh_features": features}}]
    # The ground is a second mesh without numbers.
    if ground is not None:
        attributes = {"POSITION": buffer.place(ground.corners - middle)}
        primitives.append(
            {"attributes": attributes, "indices": _index(buffer, ground), "material": 1}
        )
    # A table of properties: a value for each surface, by its number.
    schema, properties = _tabulate(
        buffer, columns, {name: names for name, names in enums.items() if name in columns}
    )
    metadata = {
        "schema": schema,
        "propertyTables": [{"class": "surface", "count": count, "properties": properties}],
    }
    # Modules have the one colour of their material, surfaces their colours at the corners.
    extras, own = {}, (1, 1, 1)
    if colour:
        extras, own = {"modules": True}, linear_light(srgb_colour(colour))
    east, north, up = (float(value) for value in middle)
    document = {
        "asset": {"copyright": copyright} if copyright else {},
        "extensionsUsed": ["EXT_mesh_features", "EXT_structural_metadata", "KHR_materials_unlit"],
        "extensions": {"EXT_structural_metadata": metadata},
        "nodes": [{"mesh": 0, "translation": [east, up, -north], "extras": extras}],
        "meshes": [{"primitives": primitives}],
        "materials": [plain_material(own), plain_material(linear_light(srgb_colour(GROUND)))],
    }
    return pack_glb(document, buffer)


def _index(buffer, shapes):
    """Accessor of the triangles."""
    kind, numbers = (UINT16, "<u2") if len(shapes.corners) < 65536 else (UINT32, "<u4")
    return buffer.access(shapes.triangles.ravel().astype(numbers), kind, "SCALAR", ELEMENTS)


def _colour_features(columns, level):
    """Colour of each feature, (n, 4) uint8 in linear light; grey where the hours are not known or
    there are no modules.
    """
    hours = np.asarray(columns["hours"], float)
    known = np.isfinite(hours) & (np.asarray(columns["kwp"]) > 0)
    shade = np.ones(len(hours))
    if "tilt" in columns:
        tilt, azimuth = np.radians(columns["tilt"]), np.radians(np.nan_to_num(columns["azimuth"]))
        normal = np.stack(
            [np.sin(tilt) * np.sin(azimuth), np.sin(tilt) * np.cos(azimuth), np.cos(tilt)], axis=1
        )
        # The sun stands as in web/viewer.js.
        shade = 0.87 + 0.13 * normal @ (
            np.array([-0.35, -0.6, 0.72]) / np.linalg.norm([-0.35, -0.6, 0.72])
        )
    linear = linear_light(srgb_light(colour_hours(hours, level, known)) * shade[:, None])
    return np.round(255 * np.column_stack([linear, np.ones(len(linear))])).astype(np.uint8)


def _tabulate(buffer, columns, enums):
    """Schema of the property table, and its properties: the views of each column."""
    classes, properties, meanings = {}, {}, {column.name: column.meaning for column in VIEWED}
    # Texts are joined, with offsets; numbers are plain, or places in a list of names.
    for name, values in columns.items():
        if values.dtype.kind == "O":
            texts = [text.encode("utf-8", "replace") for text in values]
            offsets = np.cumsum([0, *map(len, texts)]).astype("<u4")
            classes[name] = {"type": "STRING"}
            # A view may not be empty.
            properties[name] = {"values": buffer.add(b"".join(texts) or b"\0")}
            properties[name] |= {
                "stringOffsets": buffer.add(offsets.tobytes()),
                "stringOffsetType": "UINT32",
            }
        else:
            kind = {"type": "SCALAR", "componentType": values.dtype.name.upper()}
            if values.dtype.kind == "f":
                # JSON of the schema cannot name NaN, so this number stands for what is unknown.
                kind["noData"] = -99999.0
            known = np.where(np.isfinite(values), values, values.dtype.type(kind.get("noData", 0)))
            classes[name] = {"type": "ENUM", "enumType": name} if name in enums else kind
            properties[name] = {
                "values": buffer.add(known.astype(values.dtype.newbyteorder("<")).tobytes())
            }
        words = meanings.get(name.partition("_")[0] if name.startswith("month_") else name)
        classes[name] |= {"description": words} if words else {}
    # Lists of names that numbers refer to.
    return {
        "id": "citypv",
        "classes": {"surface": {"properties": classes}},
        "enums": {
            name: {
                "valueType": "UINT8",
                "values": [{"name": text, "value": k} for k, text in enumerate(names)],
            }
            for name, names in enums.items()
        },
    }, properties
