"""Materials by name, from a file, and what they do to the light: a mirror facade and the street
opposite.
"""

from pathlib import Path

import numpy as np
import pvlib
import pytest
from mirror_street import finish, light_of_strips, street, trace_street
from scenes import run_gather, suns_towards

from citypv.core.light.sun_sampling_error import trace_sun_samples
from citypv.core.light.trace_forward import trace_forward
from citypv.core.patches.brdfs import Mirror, reflect_interfaces
from citypv.core.patches.materials import (
    CLEAR,
    DIFFUSE,
    MaterialSpec,
    brdf_of_material,
    recognise_material,
)
from citypv.core.patches.read_albedo import (
    albedo_of_triangles,
    brdfs_of_triangles,
    describe_albedo,
    read_albedo,
)
from citypv.core.settings.errors import InputError
from citypv.core.settings.progress import silent
from citypv.core.settings.request import Request


@pytest.mark.slow
def test_a_glossy_facade_throws_a_blurred_beam(tmp_path):
    """Hardly rough it is a mirror; rough it lights beyond the beam and less within."""
    found = []
    for name in ("mirror", "glossy:0.001", "glossy:0.3"):
        text = f"surface,albedo,material\nfacade,0.6,{name}\nflat,0,\n"
        found.append(
            light_of_strips(trace_street(tmp_path, text, 50.0, "forward", samples=5000), 0)[0]
        )
    mirror, smooth, rough = found
    assert smooth == pytest.approx(mirror, abs=0.01)
    assert rough[0] < 0.9 * mirror[0]
    assert mirror[3] < 1e-3
    assert rough[3] > 0.02


def test_the_pilot_follows_a_forward_run_with_mirrors(tmp_path):
    path = finish(tmp_path, "surface,material\nfacade,glass\n")
    request = Request(estimator="forward", samples=16, albedo_file=path)
    suns = suns_towards([[0, -1, 1], [0, 0, 1]])
    transfer = trace_forward(street(), suns, request, silent)
    one, other = trace_sun_samples(
        street(), transfer, [transfer.suns, suns], request, lambda *report: None
    )
    assert np.array_equal(one.visible_share, other.visible_share)


def test_light_that_glass_could_reflect_has_no_bound(tmp_path):
    """At grazing incidence a pane reflects everything: no bound without a pilot; many reflections
    do no harm.
    """
    path = finish(tmp_path, "surface,material\nfacade,double glazing\n")
    request = Request(estimator="forward", samples=200, albedo_file=path, max_bounces=50)
    transfer = trace_forward(street(), suns_towards([[0, -1, 1]]), request, silent)
    (reflections,) = (
        effect for effect in transfer.record.effects if effect["key"] == "reflections"
    )
    assert reflections["bound"] is None
    for tally in transfer.record.photons.values():
        assert sum(tally.values()) == 2 * tally["emitted"]


def test_every_material_has_a_source_and_stands_in_the_docs():
    """The table of docs/reference/materials.md is that of the program, and so are its sources."""
    rows = {}
    for line in (
        (Path(__file__).parents[2] / "docs/reference/materials.md").read_text("utf-8").splitlines()
    ):
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) == 4 and cells[0].startswith("`"):
            rows[cells[0].strip("`")] = cells[1:]
    assert set(rows) == {*DIFFUSE, *CLEAR}
    for name, (least, most, source) in DIFFUSE.items():
        assert 0 < least <= most < 1
        stated, middle, cited = rows[name]
        assert stated == (f"{least:.2f} to {most:.2f}" if least < most else f"{least:.2f}")
        assert float(middle) == pytest.approx(brdf_of_material(name).albedo, abs=1e-9)
        assert cited in source
    for name, (law, source) in CLEAR.items():
        stated, straight, cited = rows[name]
        assert f"n = {law.refractive_index:g}, {law.interfaces} " in stated
        share = reflect_interfaces([1.0], law.refractive_index, law.interfaces)[0]
        assert float(straight) == pytest.approx(share, abs=5e-4)
        assert cited in source


def test_the_albedos_of_pvsyst_are_those_of_pvlib():
    """Pvlib has its table from there, too: the metals and, within the ranges, what lies on the
    ground.
    """
    albedos = pvlib.albedo.SURFACE_ALBEDOS
    metals = ("aluminium", "copper", "galvanised steel", "dirty galvanised steel")
    for ours, theirs in zip(
        metals, ("aluminum", "copper", "fresh steel", "dirty steel"), strict=True
    ):
        assert brdf_of_material(ours).albedo == albedos[theirs]
    for name in ("asphalt", "concrete", "grass", "snow", "soil", "sand"):
        least, most, _ = DIFFUSE[name]
        assert least <= albedos[name] <= most


def test_names_from_other_programs():
    assert recognise_material("Brick") == "brick"
    assert recognise_material("White_Paint.001") == "white paint"
    assert recognise_material("Double-Glazing") == "double glazing"
    assert recognise_material("mirror.012") == "mirror"
    for name in ("red brick", "bricks", "glossy:0.1", "", "Material"):
        assert recognise_material(name) == ""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("surface,albedo\nroof,1.2\n", "line 2: albedo 1.2; give a number from 0 to 1"),
        ("surface,albedo\nroof,nan\n", "line 2: albedo nan"),
        ("surface,albedo\nroof\n", "line 2 is not a name and a number"),
        ("surface,albedo\nroof,grey\n", "line 2 is not a name and a number"),
        ("surface,colour\nroof,red\n", "line 1 is not the header"),
        ("", "the file is empty"),
        (
            "surface,material\nroof,cheese\n",
            "line 2: cheese is not a known material; use one of aluminium, asphalt",
        ),
        ("surface,material\nroof,mirror\n", "line 2: mirror needs an albedo"),
        ("surface,material\nroof,brick:2\n", "line 2: brick:2 is not a known material"),
        ("surface,albedo,material\nroof,0.5,glass\n", "line 2: glass reflects by Fresnel"),
        ("surface,albedo,material\nroof,0.5,glossy:0\n", "line 2: glossy:0 needs a roughness"),
        ("surface,albedo,material\nroof,0.5,glossy\n", "line 2: glossy needs a roughness"),
        ("surface,albedo,material\nroof,0.5\n", "line 2 is not as the header"),
        ("surface,albedo,material\nroof,,\n", "line 2 is not a name and a number"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, text, words):
    with pytest.raises(InputError, match=words) as caught:
        read_albedo(finish(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_surface_before_kind_before_the_rest(tmp_path):
    text = "surface,albedo,material\ns0,0.9,\nfacade,0.5,mirror\nground,0.1,\n"
    scene = street()
    request = Request(estimator="forward", albedo=0.3, albedo_file=finish(tmp_path, text))
    scene.triangle_surface[-1] = -1  # generated ground
    assert albedo_of_triangles(scene, request)[[0, 1, 2, -1]] == pytest.approx([0.9, 0.5, 0.3, 0.1])
    brdfs, chosen = brdfs_of_triangles(scene, request)
    assert brdfs == [Mirror(0.5)]
    assert chosen[[0, 1, 2, -1]].tolist() == [-1, 0, -1, -1]
    wrong = Request(albedo_file=finish(tmp_path, "surface,albedo\nattic,0.5\n"))
    with pytest.raises(InputError, match="'attic' is neither a surface nor a kind"):
        albedo_of_triangles(scene, wrong)


# -- materials of a scene, of the generated ground and of cells --


def material_street(*names):
    """The street, the first surfaces of which have materials."""
    scene = street()
    scene.surfaces.material = [*names, *[""] * (len(scene.surfaces) - len(names))]
    return scene


def test_materials_that_cannot_be_used():
    suns = suns_towards([[0, 0, 1]])
    for finishes, words in (
        (MaterialSpec(1.2), "Material 'Glas': albedo: 1.2; give a number from 0 to 1"),
        (
            MaterialSpec(0.5, "cheese"),
            "Material 'Glas': cheese: is not a known material; use one of alu",
        ),
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
    assert albedo_of_triangles(scene, Request(albedo_file=path))[:3] == pytest.approx(
        [0.7, 0.8, 0.25]
    )
