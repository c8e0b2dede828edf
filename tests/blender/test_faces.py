"""What stands on the faces equals the arrays of core, bit for bit, also after saving."""

from pathlib import Path

import bpy
import numpy as np
import pytest

from citypv.core.settings.errors import InputError
from citypv.operators.city.attributes import (
    CODES,
    QUANTITIES,
    Faces,
    read_face_attribute,
    write_face_attribute,
)
from citypv.operators.city.build_meshes import build_meshes, read_vertices
from citypv.operators.show.draw_results import draw_results

SHARES = "sky_view_factor", "diffuse_relative", "direct_relative_annual"
HOURS = "poa_global_annual", "full_load_hours", "full_load_hours_standard_error"
CONTRACT = {"kind": "INT", "orientation": "INT"} | dict.fromkeys((*SHARES, *HOURS), "FLOAT")


def faces_of_scene(scene, generated):
    """Surface and corners of the scene's triangles, in their order."""
    chosen = (scene.triangle_surface < 0) == generated
    return scene.triangle_surface[chosen], scene.vertices[scene.triangles[chosen]].astype(
        np.float32
    )


def corners_of_mesh(item):
    indices = np.empty(len(item.data.loops), dtype=np.int32)
    item.data.loops.foreach_get("vertex_index", indices)
    return read_vertices(item)[indices].reshape(-1, 3, 3).astype(np.float32)


def assert_faces(city, ground, scene, carriers):
    """Every attribute of every face is the array's value, to the bit."""
    surfaces, corners = faces_of_scene(scene, generated=False)
    np.testing.assert_array_equal(read_face_attribute(city.data, "surface"), surfaces)
    np.testing.assert_array_equal(corners_of_mesh(city), corners)
    words = {code: word for word, code in CODES["kind"].items()}
    assert [words[code] for code in read_face_attribute(city.data, "kind")] == scene.surfaces.kind[
        surfaces
    ].tolist()
    words = {code: word for word, code in CODES["orientation"].items()}
    found = [words[code] for code in read_face_attribute(city.data, "orientation")]
    assert found == scene.surfaces.orientation[surfaces].tolist()
    for quantity in QUANTITIES:
        expected = getattr(carriers[quantity.owner], quantity.name).astype(np.float32)[surfaces]
        found = read_face_attribute(city.data, quantity.name)
        np.testing.assert_array_equal(
            found.view(np.int32), expected.view(np.int32), err_msg=quantity.name
        )
        assert np.isnan(read_face_attribute(ground.data, quantity.name)).all()
    np.testing.assert_array_equal(corners_of_mesh(ground), faces_of_scene(scene, generated=True)[1])
    assert (read_face_attribute(ground.data, "surface") == -1).all()
    assert (read_face_attribute(ground.data, "kind") == CODES["kind"]["ground"]).all()


@pytest.mark.slow
def test_saving_and_opening_keeps_every_bit(scene, transfer, energy, tmp_path):
    path = tmp_path / "city.blend"
    draw_results(tmp_path, scene, transfer, energy, "clear sky (upper bound)", pictures=["blend"])
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert not bpy.data.objects
    bpy.ops.wm.open_mainfile(filepath=str(path))
    city, ground = bpy.data.objects["City"], bpy.data.objects["Ground"]
    assert len(scene.surfaces) == 21
    assert_faces(city, ground, scene, {"transfer": transfer, "energy": energy})
    assert city["citypv_kind_codes"].to_dict() == CODES["kind"]
    assert city["citypv_orientation_codes"].to_dict() == CODES["orientation"]
    for item in (city, ground):
        for name, data_type in CONTRACT.items():
            attribute = item.data.attributes["citypv_" + name]
            assert (attribute.domain, attribute.data_type) == ("FACE", data_type)
        assert tuple(item["citypv_origin"]) == scene.site.origin
        assert item["citypv_crs"] == scene.site.crs == "EPSG:25833"
        assert (item["citypv_latitude"], item["citypv_longitude"]) == (
            scene.site.latitude,
            scene.site.longitude,
        )
    assert bpy.context.scene.camera is not None
    assert sorted(path.parent.iterdir()) == [path]


def test_the_manual_names_every_attribute_and_code():
    text = (Path(__file__).parents[2] / "docs/reference/files.md").read_text(encoding="utf-8")
    for codes in (CODES["kind"], CODES["orientation"]):
        assert ", ".join(f"{name} {code}" for name, code in codes.items()) in text
    for name in {*CONTRACT, "surface"} - {"full_load_hours_standard_error"}:
        assert f"`citypv_{name}`" in text


def test_a_mesh_that_was_edited_is_refused(scene, transfer):
    city, ground = build_meshes(scene)
    write_face_attribute(
        city.data, "surface", np.full(len(city.data.polygons), len(scene.surfaces))
    )
    with pytest.raises(
        InputError, match=r"City: its faces do not match .* classify the city again"
    ):
        Faces(city, ground).write_results(transfer)
    city.data.attributes.remove(city.data.attributes["citypv_surface"])
    with pytest.raises(InputError, match="do not match"):
        Faces(city, ground).write_results(transfer)
