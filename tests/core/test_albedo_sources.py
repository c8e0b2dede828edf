"""Where the albedo of a surface comes from: a file, a material, or one value for all."""

import pytest
from mirror_street import finish
from scenes import join, run_gather, strip, suns_towards

from citypv.core.patches.materials import MaterialSpec
from citypv.core.patches.read_albedo import albedo_of_triangles, describe_albedo
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request


def street():
    """A facade (surfaces 0 and 1) and a street before it."""
    return join([strip([0, 0, 0], [20, 0, 0], [0, 0, 10], 1), strip([0, -8, 0], [20, 0, 0], [0, 8, 0], 2)])


def material_street(*names):
    """The street, the first surfaces of which have materials."""
    scene = street()
    scene.surfaces.material = [*names, *[""] * (len(scene.surfaces) - len(names))]
    return scene


def test_materials_that_cannot_be_used():
    suns = suns_towards([[0, 0, 1]])
    for finishes, words in (
        (MaterialSpec(1.2), "Material 'Glas': albedo: 1.2; give a number from 0 to 1"),
        (MaterialSpec(0.5, "cheese"), "Material 'Glas': cheese: is not a known material; use one of alu"),
        (MaterialSpec(material="mirror"), "Material 'Glas': mirror: needs an albedo"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            run_gather(material_street("Glas"), suns, materials={"Glas": finishes})
        assert "\n" not in str(caught.value)


def test_the_generated_ground_may_have_a_material(tmp_path):
    scene = material_street("Backstein")
    scene.triangle_surface[-1] = -1
    materials = {"Backstein": MaterialSpec(0.31), "Wiese": MaterialSpec(material="grass")}
    path = finish(tmp_path, "surface,albedo\nground,0.9\n")
    request = Request(materials=materials, ground_material="Wiese", albedo_file=path)
    assert albedo_of_triangles(scene, request)[-1] == pytest.approx(0.21)
    assert describe_albedo(scene, request)[-1]["name"] == "Wiese"
    request = Request(materials=materials, ground_material="unknown", albedo_file=path)
    assert albedo_of_triangles(scene, request)[-1] == pytest.approx(0.9)


def test_cells_are_what_the_file_says_of_their_polygon(tmp_path):
    scene = street()
    scene.surfaces.surface_id[:3] = ["wall#1", "wall#2", "wall#x"]
    path = finish(tmp_path, "surface,albedo\nwall,0.7\nwall#2,0.8\n")
    assert albedo_of_triangles(scene, Request(albedo_file=path))[:3] == pytest.approx([0.7, 0.8, 0.25])
