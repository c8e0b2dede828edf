"""Cancelled while files are read: nothing is there that was not there before."""

import bpy
import pytest

from citypv.core.city.join_contents import JOINING
from citypv.core.files.read_city import READING
from citypv.core.settings.progress import CancelledError
from citypv.operators import run_step
from citypv.operators.import_city import ImportCity
from citypv.operators.run_step import Job
from citypv.operators.session import find_city, find_session


def stand():
    """What Blender's file holds, by kind."""
    kinds = "objects", "meshes", "materials", "collections", "images", "texts"
    return {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in kinds}


@pytest.fixture(params=[False, True], ids=["empty", "after another"])
def earlier(request, addon, row_file):
    """The city that was imported before, or None."""
    if request.param:
        addon.city_path = str(row_file)
        assert bpy.ops.citypv.import_city() == {"FINISHED"}
    return find_city(bpy.context.scene)[0]


@pytest.mark.parametrize("stage", [READING, JOINING, "triangulating"])
def test_nothing_is_left_of_a_cancelled_import(addon, city_file, earlier, monkeypatch, stage):
    """An earlier city stays as it was, with its session."""
    seen, session = stand(), find_session(earlier)

    def cancel(now, done, total, unit):
        if now == stage:
            raise CancelledError

    monkeypatch.setattr(run_step, "silent", cancel)
    addon.city_path = str(city_file)
    with pytest.raises(RuntimeError, match="CancelledError"):
        bpy.ops.citypv.import_city()
    assert stand() == seen
    assert find_city(bpy.context.scene)[0] == earlier
    assert find_session(earlier) is session
    monkeypatch.undo()
    assert bpy.ops.citypv.import_city() == {"FINISHED"}
    assert len(find_session(find_city(bpy.context.scene)[0]).city) == 21


def test_escape_ends_reading_and_the_panel_tells_how_far_it_is(addon, city_file):
    """The job beside the window: its text while it reads, and a cancellation instead of a city."""
    addon.city_path, texts = str(city_file), []

    class Told(Job):
        def progress(self, stage, done, total, unit):
            super().progress(stage, done, total, unit)
            texts.append((self.text, self.share))
            if done:
                self.cancel()

    job = Told("Import city", lambda progress: ImportCity.work(ImportCity.prepare(STAND, bpy.context), progress))
    job.start()
    job._thread.join(60)
    assert not job.running
    assert isinstance(job.error, CancelledError)
    assert job.result is None
    assert texts[0][0].startswith(f"{READING}: 0 %")
    assert 0 < texts[-1][1] <= 1
    assert "B/s" in texts[-1][0]


class Stand:
    """The operator's fields, as from a script."""

    filepath, files, directory = "", (), ""


STAND = Stand()
