"""A file that was saved and is opened again: weather, module and colours change as before."""

import shutil

import bpy
import numpy as np
import pytest
from steps import here, refuse, run

from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.keep_transfer import describe_missing, find_kept
from citypv.operators.city.session import Session


@pytest.fixture
def saved(addon, city_file, tmp_path):
    """A city with results that was saved: its file and its full load hours."""
    addon.city_path, addon.samples, addon.shadow_samples = str(city_file), 16, 2
    run("import_city", "classify", "trace", "energy", suns="typical-days", typical_days=1)
    path = tmp_path / "plan" / "city.blend"
    path.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    return path, read_face_attribute(here().data, "full_load_hours")


def reopen(path):
    """Open a file as another Blender does."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    city = here()
    assert Session.of(city) is None
    return city, bpy.context.scene.citypv


@pytest.mark.slow
def test_another_weather_and_module_after_reopening(saved):
    path, hours = saved
    city, settings = reopen(path)
    assert find_kept(city).name == "city.City.citypv.nc"
    run("energy")
    np.testing.assert_array_equal(read_face_attribute(city.data, "full_load_hours"), hours)
    run("energy", weather="clear-sky")
    assert np.nanmean(read_face_attribute(city.data, "full_load_hours")) > 1.2 * np.nanmean(hours)
    settings.attribute = "diffuse_relative"
    assert city["citypv_colour_attribute"] == "diffuse_relative"


@pytest.mark.slow
def test_probe_and_exports_after_reopening(saved, tmp_path):
    """They tell the same as before, without a click on Energy; where its settings have changed,
    they ask for it.
    """
    path, _ = saved
    faces = [tmp_path / "before.csv", tmp_path / "after.csv"]
    told = []
    for target in faces:
        assert bpy.ops.citypv.export(format="faces", filepath=str(target)) == {"FINISHED"}
        bpy.ops.citypv.probe(face=9, whole=True)
        told.append(list(here()["citypv_probe"]))
        assert bpy.ops.citypv.export(format="report", filepath=str(tmp_path / "report.html")) == {
            "FINISHED"
        }
        reopen(path)
    assert faces[0].read_bytes() == faces[1].read_bytes()
    assert told[0] == told[1]
    assert "Full load hours by kind" in (tmp_path / "report.html").read_text("utf-8")
    bpy.ops.citypv.probe(face=9)
    reopen(path)
    bpy.context.scene.citypv.weather = "clear-sky"
    for step in ("probe", "export"):
        refuse(step, "Compute the energy first")


@pytest.mark.slow
def test_a_file_that_is_saved_elsewhere_takes_its_light_along(saved, tmp_path):
    path, hours = saved
    reopen(path)
    other = tmp_path / "other" / "copy.blend"
    other.parent.mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(other))
    shutil.rmtree(path.parent)
    city, _ = reopen(other)
    run("energy")
    np.testing.assert_array_equal(read_face_attribute(city.data, "full_load_hours"), hours)


@pytest.mark.slow
def test_light_that_cannot_be_read_is_an_error_in_one_line_and_traced_again_by_a_button(saved):
    path, hours = saved
    light = path.parent / "city.City.citypv.nc"
    light.write_bytes(b"no NetCDF")
    reopen(path)
    refuse("energy", r"city\.City\.citypv\.nc: cannot be read as NetCDF")
    light.unlink()
    reopen(path)
    refuse("energy", r"city\.City\.citypv\.nc with the traced light is not beside this file")
    city = run("retrace")
    np.testing.assert_array_equal(read_face_attribute(city.data, "full_load_hours"), hours)
    assert describe_missing(city) == ""


@pytest.mark.slow
def test_a_folder_that_cannot_be_written_still_saves_the_file(saved, monkeypatch):
    from citypv.core.results import transfer_file

    def refuse(path, transfer):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(transfer_file, "write_transfer", refuse)
    path, _ = saved
    assert bpy.ops.wm.save_as_mainfile(filepath=str(path)) == {"FINISHED"}
    city = here()
    assert "No space left on device" in describe_missing(city)


def append_city(path):
    with bpy.data.libraries.load(str(path)) as (source, target):
        target.objects = [name for name in source.objects if name == "City"]
    bpy.context.scene.collection.objects.link(target.objects[0])
    bpy.context.view_layer.update()
    return target.objects[0]


@pytest.mark.slow
def test_a_city_that_is_appended_has_its_own_light(saved, tmp_path):
    path, hours = saved
    first = here()
    own = Session.of(first)
    other = path.with_name("other.blend")
    shutil.copyfile(path, other)
    second = append_city(other)
    assert Session.of(second) is None
    assert Session.of(first) is own
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    alone = append_city(other)
    assert find_kept(alone).is_file()
    np.testing.assert_array_equal(read_face_attribute(alone.data, "full_load_hours"), hours)
    run("energy")
    np.testing.assert_array_equal(read_face_attribute(alone.data, "full_load_hours"), hours)


@pytest.mark.slow
def test_a_copy_keeps_its_results_and_says_that_it_has_no_light(saved):
    city = here()
    city.select_set(True)
    bpy.ops.object.duplicate()
    copy = here()
    assert copy != city
    assert Session.of(copy) is None
    assert "no traced light of its own" in describe_missing(copy)
    assert not bpy.ops.citypv.energy.poll()
    bpy.data.objects.remove(copy)
    # A copy of the whole scene has a city of its own, too.
    bpy.ops.scene.new(type="FULL_COPY")
    bpy.context.view_layer.update()
    other = here()
    assert other != city
    assert Session.of(other) is None
    assert Session.of(city).transfer is not None
