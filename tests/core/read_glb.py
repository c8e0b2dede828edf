"""Reads a tile as the specifications say: glTF 2.0, EXT_mesh_features, EXT_structural_metadata, 3D
Tiles 1.1.
"""

import json
import struct
from itertools import pairwise

import numpy as np

NUMBERS = {
    5121: "u1",
    5123: "<u2",
    5125: "<u4",
    5126: "<f4",
    "UINT8": "u1",
    "UINT32": "<u4",
    "FLOAT32": "<f4",
}
WIDTH = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class Glb:
    """A binary glTF: its JSON, and views of its buffer."""

    def __init__(self, data):
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data)) and length % 4 == 0
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and size % 4 == 0
        self.json = json.loads(data[20 : 20 + size])
        rest, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0" and 28 + size + rest == length
        self.buffer = data[28 + size :]
        assert self.json["buffers"] == [{"byteLength": rest}]

    def view(self, number):
        view = self.json["bufferViews"][number]
        first = view.get("byteOffset", 0)
        assert view["buffer"] == 0 and first + view["byteLength"] <= len(self.buffer)
        return self.buffer[first : first + view["byteLength"]]

    def accessor(self, number):
        one = self.json["accessors"][number]
        kind, view = (
            np.dtype(NUMBERS[one["componentType"]]),
            self.json["bufferViews"][one["bufferView"]],
        )
        width, first = WIDTH[one["type"]], one.get("byteOffset", 0)
        assert view.get("byteStride", width * kind.itemsize) == width * kind.itemsize
        values = np.frombuffer(self.view(one["bufferView"]), kind, one["count"] * width, first)
        values = values.reshape(-1, width) if width > 1 else values
        assert "byteOffset" in one or len(self.view(one["bufferView"])) == values.nbytes
        if "min" in one:
            assert (
                values.min(axis=0).tolist() == one["min"]
                and values.max(axis=0).tolist() == one["max"]
            )
        return values

    def features(self):
        """Corners of the triangles, (t, 3, 3) in the tile's frame with z up, and the feature of
        each, (t,).
        """
        (node,) = self.json["nodes"]
        part = self.json["meshes"][node["mesh"]]["primitives"][0]
        places = self.accessor(part["attributes"]["POSITION"]) + np.array(node["translation"])
        (ids,) = part["extensions"]["EXT_mesh_features"]["featureIds"]
        feature = self.accessor(part["attributes"][f"_FEATURE_ID_{ids['attribute']}"])
        triangles = self.accessor(part["indices"]).reshape(-1, 3)
        assert (feature[triangles] == feature[triangles[:, :1]]).all()
        assert feature.max() < ids["featureCount"] and ids["propertyTable"] == 0
        # 3D Tiles 1.1: y up becomes z up
        places = np.stack([places[:, 0], -places[:, 2], places[:, 1]], axis=1)
        return places[triangles], feature[triangles[:, 0]].astype(int)

    def table(self):
        """Columns of the property table: dict of list or array."""
        metadata = self.json["extensions"]["EXT_structural_metadata"]
        (table,), schema = metadata["propertyTables"], metadata["schema"]
        known = schema["classes"][table["class"]]["properties"]
        return {
            name: self.column(known[name], place, schema)
            for name, place in table["properties"].items()
        }

    def column(self, about, place, schema):
        for name in ("values", "stringOffsets"):
            assert name not in place or self.json["bufferViews"][place[name]]["byteOffset"] % 8 == 0
        values = self.view(place["values"])
        if about["type"] == "STRING":
            offsets = np.frombuffer(self.view(place["stringOffsets"]), "<u4")
            return [values[a:b].decode("utf-8") for a, b in pairwise(offsets)]
        if about["type"] == "ENUM":
            one = schema["enums"][about["enumType"]]
            names = {entry["value"]: entry["name"] for entry in one["values"]}
            return [
                names[value] for value in np.frombuffer(values, NUMBERS[one["valueType"]]).tolist()
            ]
        numbers = np.frombuffer(values, NUMBERS[about["componentType"]])
        return (
            np.where(numbers == about["noData"], np.nan, numbers) if "noData" in about else numbers
        )


def visit_tiles(folder, name="tileset.json", above=None, transform=None):
    """All tiles with content, of which the rules are checked: yields (tile, path, (4, 4) for rows
    [x, y, z, 1]).
    """
    tileset = json.loads((folder / name).read_text("utf-8"))
    assert (
        tileset["asset"]["version"] == "1.1"
        and tileset["geometricError"] >= tileset["root"]["geometricError"]
    )
    waiting = [(tileset["root"], above, np.eye(4) if transform is None else transform)]
    while waiting:
        tile, error, matrix = waiting.pop()
        assert error is None or tile["geometricError"] <= error
        matrix = np.array(tile.get("transform", np.eye(4).ravel())).reshape(4, 4) @ matrix
        if uri := tile.get("content", {}).get("uri"):
            if uri.endswith(".json"):
                yield from visit_tiles(folder, uri, tile["geometricError"], matrix)
            else:
                yield tile, folder / uri, matrix
        waiting += [(child, tile["geometricError"], matrix) for child in tile.get("children", [])]
