"""Cancelled while suns are traced: the panel keeps what is done and says so."""

import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from steps import here, run, session_here

from citypv.core.city.join_contents import JOINING
from citypv.core.light import sun_blocks
from citypv.core.read.read_city import READING
from citypv.core.results.transfer_file import write_transfer
from citypv.core.settings.progress import CancelledError, silent
from citypv.operators.city import run_step
from citypv.operators.city.attributes import read_face_attribute
from citypv.operators.city.build_meshes import hold_cities
from citypv.operators.city.job import Job
from citypv.operators.city.read_settings import read_settings
from citypv.operators.city.run_step import Step
from citypv.operators.city.session import Session
from citypv.operators.run.compute_energy import WeighEnergy
from citypv.operators.run.export_results import ExportResults
from citypv.operators.show.timeline import StartTimeline


def cancel_at(stage, share):
    def progress(now, done, total, unit):
        if now == stage and done >= share * total:
            raise CancelledError

    return progress


@pytest.mark.slow
def test_what_was_traced_is_kept_and_told(addon, city_file, monkeypatch):
    run(
        "import_city",
        "classify",
        city_path=str(city_file),
        samples=64,
        suns="typical-days",
        typical_days=6,
    )
    monkeypatch.setattr(sun_blocks, "SUNS_PER_BLOCK", 12)
    monkeypatch.setattr(run_step, "silent", cancel_at("suns", 0.5))
    city = run("trace")
    transfer = Session.of(city).transfer
    kept, count = transfer.record.interrupted["suns_traced"], transfer.record.interrupted["of"]
    assert 0 < kept < count
    assert transfer.visible_share.shape[1] == len(transfer.suns) == kept
    assert city["citypv_interrupted"] == f"Interrupted: kept {kept} of {count} suns"
    # The next step takes it, and a whole trace takes the sentence away.
    monkeypatch.undo()
    run("energy")
    part = read_face_attribute(city.data, "full_load_hours")
    run("trace")
    assert city["citypv_interrupted"] == ""
    run("energy")
    whole = read_face_attribute(city.data, "full_load_hours")
    assert np.nanmean(part) == pytest.approx(np.nanmean(whole), rel=0.05)
    assert not np.array_equal(part, whole, equal_nan=True)


def make_step(job, scene=None):
    """The modal operator of a job without a window; it keeps what it reports, and in which scenes
    it ends.
    """
    hold_cities(bpy.context.scene, "Trace light")  # as each step begins

    class Stand(Step):
        bl_label, _job, _scene, told, scenes = "Trace light", job, scene, [], []

        def report(self, level, text):
            self.told.append((level, text))

        def finish(self, context, result):
            self.scenes.append(context.scene)
            return f"kept {result}"

        def _leave(self, context):
            pass

    return Stand()


def end_of(job, scene=None):
    """What it does when its job is over."""
    step = make_step(job, scene)
    return step._end(bpy.context), step.told, step.scenes


def job_that_keeps(cancels):
    """A job whose work keeps 42 when it is cancelled, cancelled so often."""
    begun = threading.Event()

    def work(progress):
        try:
            while True:
                progress("suns", 1, 2, "rays")
                begun.set()
                time.sleep(0.01)
        except CancelledError:
            return 42

    job = Job("Trace light", work)
    job.start()
    assert begun.wait(10)
    for _ in range(cancels):
        job.cancel()
    job.join()
    return job


def test_a_step_ends_in_the_scene_that_it_was_started_in(addon):
    """The window may show another scene by then: the results are not lost."""
    begun = bpy.context.scene
    bpy.ops.scene.new(type="EMPTY")
    assert bpy.context.scene != begun
    assert end_of(Job("Trace light", None), begun.session_uid)[2] == [begun]


def test_escape_keeps_what_is_done_and_twice_nothing():
    job = job_that_keeps(cancels=1)
    assert job.text == "Trace light: keeps what is done"
    assert end_of(job) == ({"FINISHED"}, [({"WARNING"}, "kept 42")], [bpy.context.scene])
    job = job_that_keeps(cancels=2)
    assert job.text == "Trace light: ends, and keeps nothing"
    assert end_of(job) == (
        {"CANCELLED"},
        [({"WARNING"}, "Trace light was cancelled; nothing was changed")],
        [],
    )


def test_escape_twice_ends_a_step_at_once_which_is_silent(addon):
    """After Esc once it waits for the next report, since something may be kept."""
    going, tick = threading.Event(), SimpleNamespace(type="TIMER", value="NOTHING")
    step = make_step(Job("Trace light", lambda progress: going.wait(60)))
    nothing = SimpleNamespace(windows=[], status_text_set=lambda text: None)
    window = SimpleNamespace(scene=bpy.context.scene, workspace=nothing, window_manager=nothing)
    step._job.start()
    step._job.cancel()
    assert step.modal(window, tick) == {"PASS_THROUGH"}
    step._job.cancel()
    assert step.modal(window, tick) == {"CANCELLED"}
    assert step._job.is_alive() and step.told == [
        ({"WARNING"}, "Trace light was cancelled; nothing was changed")
    ]
    going.set()
    step._job.join()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["export", "timeline", "energy"])
def test_work_that_goes_on_after_escape_twice_changes_no_session(traced, tmp_path, name):
    """What it reads and weighs in its thread is kept in Blender's, once it is finished: a session
    may be another's.
    """
    session, kept = session_here(), tmp_path / "light.nc"
    write_transfer(kept, session.transfer)
    session.transfer = session.weather = session.energy = None
    before, request = replace(session), read_settings(bpy.context.scene.citypv)
    if name == "export":
        path = tmp_path / "faces.csv"
        ExportResults.work((session, (kept, request), "faces", path, (None, [])), silent)
        assert len(path.read_text("utf-8").splitlines()) > len(session.scene.surfaces)
    else:
        {"timeline": StartTimeline, "energy": WeighEnergy}[name].work(
            (session, kept, request), silent
        )
    assert vars(session) == vars(before)


# -- cancelled while files are read: nothing is there that was not there before --


def stand():
    """What Blender's file holds, by kind."""
    kinds = "objects", "meshes", "materials", "collections", "images", "texts"
    return {kind: sorted(one.name for one in getattr(bpy.data, kind)) for kind in kinds}


@pytest.mark.parametrize("stage", [READING, JOINING, "triangulating"])
def test_nothing_is_left_of_a_cancelled_import(addon, city_file, row_file, monkeypatch, stage):
    """An earlier city stays as it was, with its session."""
    earlier = run("import_city", city_path=str(row_file))
    seen, session = stand(), Session.of(earlier)
    monkeypatch.setattr(run_step, "silent", cancel_at(stage, 0))
    addon.city_path = str(city_file)
    with pytest.raises(RuntimeError, match="CancelledError"):
        bpy.ops.citypv.import_city()
    assert stand() == seen
    assert here() == earlier
    assert Session.of(earlier) is session
    monkeypatch.undo()
    run("import_city")
    assert len(session_here().city) == 21


def test_a_file_browser_that_is_closed_cancels_nothing(addon):
    """Blender calls `cancel` then too, of an operator whose work has not begun."""
    closed = SimpleNamespace(_job=ExportResults._job)  # no method of the step may be called
    assert Step.cancel(closed, bpy.context) is None and Step.current is None
